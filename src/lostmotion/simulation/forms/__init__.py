"""Forms in which a scenario is written: a drive, an axis or a train, all read as the tables of a train."""

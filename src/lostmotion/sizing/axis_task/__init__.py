"""Tasks of an axis: the scenario of a candidate, and the demands of a cycle on its motor and gearbox."""

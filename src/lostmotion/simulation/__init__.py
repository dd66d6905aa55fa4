"""From a scenario to a labelled dataset."""

"""Expressions of result variables that a study keeps of each run."""

"""Identification files: the task that a file states, its formulas, and the parameters that are sought."""

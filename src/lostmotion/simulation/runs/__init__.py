"""Runs of scenarios, their results, and the files of these."""

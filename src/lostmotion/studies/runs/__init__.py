"""Runs of a study, chunk by chunk, and their table on disk."""

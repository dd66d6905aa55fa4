"""Scenarios for programs without Python: the description that the C interface reads, and what is built on it."""

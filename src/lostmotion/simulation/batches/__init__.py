"""Batches: many drives advanced together, each with its own parameters."""

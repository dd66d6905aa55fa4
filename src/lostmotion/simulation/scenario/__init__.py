"""Scenarios: their files, their keys and units, and what functions require of them."""

"""Simulations that are advanced step by step: for control loops, co-simulation and robots."""

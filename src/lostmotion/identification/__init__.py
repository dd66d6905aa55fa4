"""Identification: from measured logs to the values of a drive, their intervals, and what the logs cannot tell."""

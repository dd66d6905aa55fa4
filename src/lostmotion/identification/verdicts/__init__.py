"""Verdicts on a fit: unidentifiable parameters, residuals that are not noise, logs that disagree."""

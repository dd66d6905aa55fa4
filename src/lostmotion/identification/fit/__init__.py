"""The fit of parameters to logs: start values, least squares, intervals."""

"""Input of any kind: fields with units, TOML files, and what is wrong with a value."""

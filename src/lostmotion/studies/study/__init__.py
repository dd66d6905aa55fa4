"""Studies: their files, what varies, and what is kept of each run."""

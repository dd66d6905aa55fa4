"""Units at the edge: what may be written, and its value in SI."""

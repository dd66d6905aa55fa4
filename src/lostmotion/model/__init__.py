"""The parts of a drive, the signals that act on it and what is asked of it."""

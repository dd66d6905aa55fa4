"""Linear models, periodic motions and frequency responses."""

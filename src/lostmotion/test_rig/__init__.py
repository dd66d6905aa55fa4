"""The virtual test rig."""

"""The rig of a log: its scenario, its inputs, its runs, and their residuals."""

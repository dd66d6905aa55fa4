"""Many runs: what is varied, what is kept, and what is selected."""

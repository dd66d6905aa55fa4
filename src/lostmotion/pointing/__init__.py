"""What pointing axes miss, and what causes it."""

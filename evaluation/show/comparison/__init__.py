"""Two or more runs on one page: what changed, beyond chance or not."""

"""What is known to be true, and how far results lie from it."""

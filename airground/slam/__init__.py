"""Section IV: where each robot's camera is."""

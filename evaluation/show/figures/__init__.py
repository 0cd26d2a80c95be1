"""One figure a file; each takes data and returns a matplotlib Figure."""

"""The pictures of one flight."""

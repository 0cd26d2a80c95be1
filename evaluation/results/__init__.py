"""What experiments leave: rows, the folder they lie in, and the summary."""

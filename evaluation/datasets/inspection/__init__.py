"""Contents of a dataset, and defects in it."""

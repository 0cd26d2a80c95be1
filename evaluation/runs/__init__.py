"""A recording through the pipeline, measured: both robots, one alone, or two of a user's own."""

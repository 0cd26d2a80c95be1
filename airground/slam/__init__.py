"""Where each robot is, by its own sensors (Sec. IV)."""

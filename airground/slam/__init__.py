"""Section IV: the pose of each robot, from its own sensors."""

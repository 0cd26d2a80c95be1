"""What images alone tell about poses and points, one frame or one pair of frames at a time."""

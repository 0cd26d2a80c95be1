"""Use of the IMU: motion between images, rest, gravity and metric scale (Sec. IV)."""

"""What the IMU says: motion between images, rest, gravity and metric scale (Sec. IV)."""

"""What crosses rooms: rigid motions, the camera model, messages, clouds, events."""

"""Data types that all stages share: rigid motions, cameras, messages, clouds, events."""

"""Recordings, trajectories and clouds on disk."""

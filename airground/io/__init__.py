"""Recordings, trajectories and clouds on disk. Nothing here ever opens `truth/`."""

"""Simulated recordings with their truth, from scene files.

A scene file (`scene`) becomes a MuJoCo world (`world`, from the shapes of `geometry` and the
pictures of `appearance`); both robots move in it (`robots`); `sensors` adds the faults of real
sensors; `recording` renders the images and writes everything to disk.
"""

"""Simulated recordings with their truth, from scene files.

A scene file (`scene`) becomes a MuJoCo world (`world`, from `geometry` and `appearance`); `robots`
move in it; `sensors` adds the faults of real sensors; `recording` renders and writes to disk.
"""

"""A flight of few frames over two boxes, which is soon recorded."""

import numpy as np

from sim.recording.recorder import image_stamps
from sim.world.world import World

SCENE = """
name = "small"
description = "Two boxes in a small room."
kind = "rubble"
duration_s = 5.0
overlap_expected = 0.5
[room]
size_m = [5.0, 5.0]
wall_height_m = 0.0
[rubble]
boxes = 2
area_m = [2.0, 2.0]
edge_m = [0.2, 0.4]
makes = 2
[mav]
start = [-1.0, 0.0]
takeoff_s = 1.6
waypoints = [[-1.0, 0.0], [1.0, 0.0]]
[ground]
waypoints = [[-2.0, 0.0, 0], [-1.0, 0.0, 0]]
"""
FRAMES = 3


def few_stamps(motion_stamps_ns: np.ndarray, first_ns: int) -> np.ndarray:
    """The first, the middle and the last image that a recording would have."""
    stamps = image_stamps(motion_stamps_ns, first_ns)
    return stamps[np.linspace(0, len(stamps) - 1, FRAMES).astype(int)]


def unpainted(plain: World) -> World:
    """The world as it is: pictures take long to make."""
    return plain

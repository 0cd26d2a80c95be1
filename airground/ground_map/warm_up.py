"""Compiles every kernel of the room, so that the first ground map is not slow."""

from __future__ import annotations

import numpy as np

from airground.core.se3 import SE3, rotation_angle
from airground.ground_map.surface_points import BLOCK, BlockedField, surface_points


def warm_up_ground_map() -> None:
    """Measures how far a pose has turned, and finds a plane in a field of one block."""
    pose = SE3.identity()
    rotation_angle(pose.rotation.T @ pose.rotation)
    shape = (1, BLOCK, BLOCK, BLOCK)
    heights = np.arange(BLOCK, dtype=np.float32) - BLOCK / 2 + 0.3
    tsdf = np.broadcast_to(heights[:, None, None], shape).astype(np.float32)
    colour = np.zeros((*shape, 3), np.float32)
    places, rows = np.zeros((1, 3), np.int32), np.zeros(1, np.int32)
    surface_points(BlockedField(places, rows, tsdf, np.ones_like(tsdf), colour, 1.0), 0.5)

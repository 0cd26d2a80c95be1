"""Compiles every kernel of the room, so that the first ground map is not slow."""

from __future__ import annotations

import numpy as np

from airground.config import GroundMapping
from airground.core.camera import PinholeCamera
from airground.core.messages import GroundImage
from airground.core.se3 import SE3, rotation_angle
from airground.ground_map.fused_map import GroundMap


def warm_up_ground_map() -> None:
    """Measures how far a pose has turned, and maps a wall."""
    pose = SE3.identity()
    rotation_angle(pose.rotation.T @ pose.rotation)
    ground_map = GroundMap(PinholeCamera(32, 24, 30.0, 30.0, 15.5, 11.5), GroundMapping())
    wall = np.ones((24, 32), np.float32)
    ground_map.add(GroundImage(0, np.zeros((24, 32, 3), np.uint8), wall), pose)
    ground_map.cloud()

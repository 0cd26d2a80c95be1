"""Compiles every kernel of the room, so that the first alignment is not slow."""

from __future__ import annotations

import numpy as np

from airground.config import Config
from airground.core.cloud import PointCloud
from airground.core.se3 import SE3
from airground.refinement.alignment import refine

SIDE_M = 1.0
POINTS_A_SIDE = 60


def warm_up_refinement(config: Config) -> None:
    """Aligns a bump with itself."""
    x, y = np.meshgrid(*[np.linspace(-SIDE_M, SIDE_M, POINTS_A_SIDE)] * 2)
    bump = np.column_stack([x.ravel(), y.ravel(), np.exp(-4 * (x**2 + y**2)).ravel()])
    cloud = PointCloud(bump.astype(np.float32), np.zeros((len(bump), 3), np.uint8))
    refine(0, SE3.identity(), cloud, cloud, config)

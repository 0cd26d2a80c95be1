"""Compiles everything above tracking before the first frame is waiting for it."""

from __future__ import annotations

import numpy as np

from airground.config import Config
from airground.core.cloud import PointCloud
from airground.core.se3 import SE3
from airground.dense.warm_up import warm_up as warm_up_dense
from airground.localization.particle_filter import MonteCarloLocalizer
from airground.refinement import refine

SIDE_M, STEP_M = 2.0, 0.01
SURFACES = 2
"""The first searches everywhere, the second only where the particles are."""


def warm_up_mapping(config: Config, rng: np.random.Generator) -> None:
    """Take something small through all stages: reconstruct, locate and refine it.

    Args:
        config: The pipeline's parameters.
        rng: Draws the particles.
    """
    warm_up_dense(config)
    heap = _heap()
    localizer = MonteCarloLocalizer(config, rng)
    for _ in range(SURFACES):
        above, beside = np.array([0.0, 0.0, 2.0]), np.zeros(2)
        for _event in localizer.update(0, heap.points, above, heap.points, beside, 0.0):
            pass
    refine(0, SE3.identity(), heap, heap, config)


def _heap() -> PointCloud:
    """Waves on a floor, seen from above."""
    axis = np.arange(0.0, SIDE_M, STEP_M) - SIDE_M / 2
    x, y = (part.ravel() for part in np.meshgrid(axis, axis))
    z = 0.15 * np.sin(5 * x) * np.cos(4 * y)
    slope_x = 0.75 * np.cos(5 * x) * np.cos(4 * y)
    slope_y = -0.6 * np.sin(5 * x) * np.sin(4 * y)
    normals = np.stack([-slope_x, -slope_y, np.ones_like(z)], axis=1)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    points = np.stack([x, y, z], axis=1).astype(np.float32)
    colours = np.full((len(points), 3), 90, np.uint8)
    return PointCloud(points, colours, normals.astype(np.float32))

"""Compiles every kernel of the room, so that the first aerial map is not slow."""

from __future__ import annotations

import numpy as np

from airground.config import Config
from airground.core.cloud import PointCloud
from airground.localization.height_map_pair import HeightMapPair
from airground.localization.particle_filter import MonteCarloLocalizer

SIDE_M = 1.0
POINTS_A_SIDE = 60


def warm_up_localization(config: Config, rng: np.random.Generator) -> None:
    """Locates a bump on itself twice: with particles to draw, then with particles to move.

    Args:
        config: Configuration; it selects the kernels.
        rng: Source of the particles.
    """
    few = {"search_radius_m": 0.2, "headings": 4}
    localization = config.localization.model_copy(update=few)
    small = config.model_copy(update={"localization": localization})
    localizer = MonteCarloLocalizer(small, rng)
    x, y = np.meshgrid(*[np.linspace(-SIDE_M, SIDE_M, POINTS_A_SIDE)] * 2)
    bump = np.column_stack([x.ravel(), y.ravel(), np.exp(-4 * (x**2 + y**2)).ravel()])
    # Clouds cannot be written to, which kernels are compiled for.
    points = PointCloud(bump.astype(np.float32), np.zeros((len(bump), 3), np.uint8)).points
    for stamp_ns in range(2):
        pair = HeightMapPair(stamp_ns, points, np.zeros(3), points, np.zeros(2), 0.0, small)
        for _ in localizer.update(pair):
            pass

"""Depth measured at corners of the image."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

MAX_SPREAD = 0.05
"""Corners like to sit on silhouettes: where depth varies more than this share of it within a
pixel's neighbours, it may belong to either side."""


def inverse_depths_at(
    depth: NDArray[np.float32], pixels: NDArray, max_depth_m: float
) -> NDArray[np.float64]:
    """(N,) inverse depth [1/m] at (N, 2) pixels; NaN where none can be trusted.

    Args:
        depth: (height, width) [m], NaN where missing.
        pixels: (x, y) of the corners.
        max_depth_m: Depth beyond this is not used.
    """
    height, width = depth.shape
    x = np.rint(pixels[:, 0]).astype(np.int64).clip(1, width - 2)
    y = np.rint(pixels[:, 1]).astype(np.int64).clip(1, height - 2)
    offsets = np.array([(dx, dy) for dy in (-1, 0, 1) for dx in (-1, 0, 1)])
    around = depth[y[:, None] + offsets[:, 1], x[:, None] + offsets[:, 0]].astype(np.float64)
    middle = np.median(around, axis=1)
    with np.errstate(invalid="ignore"):
        steady = np.ptp(around, axis=1) < MAX_SPREAD * middle
        good = steady & (middle > 0) & (middle <= max_depth_m)
    return np.where(good, 1.0 / np.where(good, middle, 1.0), np.nan)

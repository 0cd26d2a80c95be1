"""Depth measured at corners of the image."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

REACH_PX = 4
MAX_SPREAD = 0.05
"""Corners like to sit on silhouettes, and colour and depth are not taken at the same moment:
where depth varies more than this share of it within reach, it may belong to either side."""


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
    x = np.rint(pixels[:, 0]).astype(np.int64).clip(REACH_PX, width - 1 - REACH_PX)
    y = np.rint(pixels[:, 1]).astype(np.int64).clip(REACH_PX, height - 1 - REACH_PX)
    steps = (-REACH_PX, -1, 0, 1, REACH_PX)
    offsets = np.array([(dx, dy) for dy in steps for dx in steps])
    around = depth[y[:, None] + offsets[:, 1], x[:, None] + offsets[:, 0]].astype(np.float64)
    middle = np.median(around, axis=1)
    with np.errstate(invalid="ignore"):
        steady = np.ptp(around, axis=1) < MAX_SPREAD * middle
        good = steady & (middle > 0) & (middle <= max_depth_m)
    return np.where(good, 1.0 / np.where(good, middle, 1.0), np.nan)

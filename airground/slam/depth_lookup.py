"""Depth measured at corners of the image."""

from __future__ import annotations

import numpy as np
from numba import njit

from airground.core.arrays import F32, F64, Floats

REACH_PX = 4
STEPS = (-REACH_PX, -1, 0, 1, REACH_PX)
"""Where depth is looked at beside a corner, along both axes [px]."""
MAX_SPREAD = 0.05
"""Largest relative spread of depth around a corner. Corners often lie on silhouettes, and colour
and depth are not taken at the same moment: the depth may belong to either side."""


def inverse_depths_at(depth: F32 | None, pixels: Floats, max_depth_m: float) -> F64:
    """(N,) inverse depth [1/m] at (N, 2) pixels; NaN where none can be trusted.

    Args:
        depth: (height, width) depth [m], NaN where missing; None without a depth camera.
    """
    inverse = np.full(len(pixels), np.nan)
    if depth is not None:
        asked = np.asarray(pixels, np.float64)
        _look_up(np.asarray(depth, np.float32), asked, max_depth_m, inverse)
    return inverse


@njit(cache=True, nogil=True, error_model="numpy")
def _look_up(depth: F32, pixels: F64, max_depth_m: float, inverse: F64) -> None:
    """The median of 25 depths around each pixel, compiled: every image asks for hundreds."""
    height, width = depth.shape
    around = np.empty(len(STEPS) ** 2)
    for i in range(len(pixels)):
        x = min(max(int(np.rint(pixels[i, 0])), REACH_PX), width - 1 - REACH_PX)
        y = min(max(int(np.rint(pixels[i, 1])), REACH_PX), height - 1 - REACH_PX)
        inverse[i] = np.nan
        whole = True
        count = 0
        for dy in STEPS:
            for dx in STEPS:
                value = float(depth[y + dy, x + dx])
                whole &= not np.isnan(value)
                # Sorted as they come.
                place = count
                while place > 0 and around[place - 1] > value:
                    around[place] = around[place - 1]
                    place -= 1
                around[place] = value
                count += 1
        middle = around[count // 2]
        steady = around[count - 1] - around[0] < MAX_SPREAD * middle
        if whole and steady and 0 < middle <= max_depth_m:
            inverse[i] = 1.0 / middle

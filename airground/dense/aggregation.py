"""From summed photometric errors to a mean cost per pixel and plane (Sec. V).

The sum over a window is divided by the number of samples in it that some view really had,
so that what lies outside a view neither costs nor saves anything.
"""

from __future__ import annotations

import numpy as np
from numba import njit, prange
from numpy.typing import NDArray

from airground.dense.plane_sweep import CostVolume
from airground.dense.sweep_kernels import COST_SCALE

FAST = {"contract", "reassoc", "arcp", "nsz"}
MEAN_SCALE = 128.0
"""Mean costs are stored in 1/128 of a grey level."""
ROWS_A_TASK = 12


def aggregate(volumes: list[CostVolume], window_px: int, truncation: float) -> NDArray[np.uint16]:
    """Mean cost over a square window and over all views of the given volumes.

    Args:
        volumes: One or both sides of a sweep.
        window_px: Side of the window, odd.
        truncation: Cost of a sample at most, and of a place that no view covers [grey levels].

    Returns:
        (height, width, planes) uint16 in 1/128 of a grey level.
    """
    if window_px % 2 == 0:
        raise ValueError(f"window_px must be odd, got {window_px}")
    height, planes, width = volumes[0].costs.shape
    mean = np.empty((height, width, planes), np.uint16)
    first, last = volumes[0], volumes[-1]
    limits = np.stack([one for volume in volumes for one in volume.limits])
    box_mean(
        first.costs,
        last.costs,
        len(volumes) > 1,
        limits,
        window_px // 2,
        np.float32(MEAN_SCALE / COST_SCALE),
        np.float32(MEAN_SCALE * truncation),
        mean,
    )
    return mean


@njit(cache=True, error_model="numpy", fastmath=FAST)
def _change_row(
    first: NDArray,
    last: NDArray,
    both: bool,
    limits: NDArray,
    y: int,
    sign: int,
    sums: NDArray,
    counts: NDArray,
    margin: int,
) -> None:
    """Adds (sign 1) or takes away (sign -1) image row y from the running window sums."""
    _, planes, width = first.shape
    signed = np.int32(sign)
    for p in range(planes):
        total = sums[p, margin : margin + width]
        one = first[y, p]
        for x in range(width):
            total[x] += signed * np.int32(one[x])
        if both:
            other = last[y, p]
            for x in range(width):
                total[x] += signed * np.int32(other[x])
        for v in range(len(limits)):
            lo, hi = limits[v, y, p, 0], limits[v, y, p, 1]
            covered = counts[p, margin + lo : margin + hi]
            for x in range(len(covered)):
                covered[x] += signed


@njit(cache=True, parallel=True, error_model="numpy", fastmath=FAST)
def box_mean(
    first: NDArray,
    last: NDArray,
    both: bool,
    limits: NDArray,
    radius: int,
    scale: float,
    uncovered: float,
    mean: NDArray,
) -> None:
    """Fills `mean`; see `aggregate`.

    Args:
        first, last: (height, planes, width) uint16 summed costs; `last` counts if `both`.
        both: Whether there are two volumes.
        limits: (views, height, planes, 2) int16 columns [lo, hi) that a view covers.
        radius: The window is 2 radius + 1 wide and high.
        scale: From stored sums to stored means.
        uncovered: Stored mean where no view covers the window.
        mean: (height, width, planes) uint16, filled.
    """
    height, planes, width = first.shape
    tasks = (height + ROWS_A_TASK - 1) // ROWS_A_TASK
    for task in prange(tasks):
        begin = task * ROWS_A_TASK
        end = min(begin + ROWS_A_TASK, height)
        sums = np.zeros((planes, width + 2 * radius), np.int32)
        counts = np.zeros((planes, width + 2 * radius), np.int32)
        total = np.empty(width, np.int32)
        count = np.empty(width, np.int32)
        block = np.empty((planes, width), np.uint16)
        for y in range(max(begin - radius, 0), min(begin + radius, height)):
            _change_row(first, last, both, limits, y, 1, sums, counts, radius)
        for y in range(begin, end):
            if y + radius < height:
                _change_row(first, last, both, limits, y + radius, 1, sums, counts, radius)
            for p in range(planes):
                total[:] = 0
                count[:] = 0
                for i in range(2 * radius + 1):
                    some, seen = sums[p, i : i + width], counts[p, i : i + width]
                    for x in range(width):
                        total[x] += some[x]
                        count[x] += seen[x]
                out = block[p]
                for x in range(width):
                    n = np.float32(max(count[x], np.int32(1)))
                    value = scale * np.float32(total[x]) / n
                    out[x] = np.uint16(np.int32(value if count[x] > 0 else uncovered))
            _transpose(block, mean[y])
            if y - radius >= 0:
                _change_row(first, last, both, limits, y - radius, -1, sums, counts, radius)


@njit(cache=True, error_model="numpy")
def _transpose(block: NDArray, out: NDArray) -> None:
    """out = block.T in tiles that fit the cache's lines."""
    planes, width = block.shape
    for x0 in range(0, width, 32):
        x1 = min(x0 + 32, width)
        for p0 in range(0, planes, 32):
            p1 = min(p0 + 32, planes)
            for x in range(x0, x1):
                line = out[x, p0:p1]
                for p in range(p1 - p0):
                    line[p] = block[p0 + p, x]

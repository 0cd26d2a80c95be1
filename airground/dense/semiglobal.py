"""Semi-global smoothing of the cost volume (Hirschmueller, PAMI 2008), our addition.

Along four directions each pixel's costs are joined with those of the pixel before it: staying on
the plane is free, the next plane costs little, a jump costs more, and less across an image edge.
It helps where texture is weak, and lets depth jump exactly at the outlines of boxes."""

from __future__ import annotations

import numpy as np
from numba import njit, prange

from airground.config import PlaneSweep as Parameters
from airground.core.arrays import F32, FAST, U16
from airground.dense.aggregation import MEAN_SCALE
from airground.dense.plane_sweep import Workspace

STRIPS = 16
"""Columns are shared out in this many strips for the vertical directions."""
ROWS_AT_A_TIME = 8
"""Rows whose paths are extended in turns: what a path's next pixel needs of the pixel before
has then left the processor's store buffer, for which it would wait otherwise."""
_UNREACHABLE = np.uint16(30000)
"""Stands beside the first and the last plane."""


def smooth(mean: U16, reference: F32, parameters: Parameters, workspace: Workspace) -> U16:
    """Sum over four directions of the costs of the cheapest path that ends at each pixel.

    Args:
        mean: (height, width, planes) uint16, costs in 1/128 of a grey level.
        reference: (height, width) float32, the image whose edges make jumps cheap.
        parameters: Section `plane_sweep` of the configuration.
        workspace: Memory of the result.

    Returns:
        (height, width, planes) uint16. Path costs are counted from the path's cheapest
        plane before, so that they stay below cost + jump penalty and the sum fits.
    """
    total = workspace.take(mean.shape)
    step = int(MEAN_SCALE * parameters.step_penalty)
    jump = MEAN_SCALE * parameters.jump_penalty
    across, down = np.empty((2, *reference.shape), np.uint16)
    jump_penalties(reference, step, jump, parameters.edge_levels, across, down)
    along_rows(mean, across, step, total)
    along_columns(mean, down, step, total)
    return total


@njit(cache=True, parallel=True, nogil=True, error_model="numpy")
def jump_penalties(image: F32, step: int, jump: float, edge: float, across: U16, down: U16) -> None:
    """Fills (height, width) `across` and `down`: between a pixel and the one left of or above it.
    The jump penalty is lower across an edge of the image, and never below `step`."""
    height, width = image.shape
    for y in prange(height):
        for x in range(width):
            left, above = image[y, max(x - 1, 0)], image[max(y - 1, 0), x]
            across[y, x] = max(int(jump / (1.0 + abs(image[y, x] - left) / edge)), step)
            down[y, x] = max(int(jump / (1.0 + abs(image[y, x] - above) / edge)), step)


@njit(cache=True, inline="always", error_model="numpy")
def _extend(
    cost: U16, before: U16, after: U16, total: U16, lowest: np.uint16, step: int, jump: np.uint16
) -> np.uint16:
    """One pixel of one path; returns the lowest of `after`.

    Args:
        cost: (planes,) uint16 costs of the pixel.
        before, after: (planes + 2,) uint16 path costs at the previous pixel, and here (filled),
            with one guard at either end.
        total: (planes,) uint16 sum of path costs, added to.
        lowest: Lowest of `before`.
        step, jump: Penalties of a step and of a jump.
    """
    small, cap = np.uint16(step), np.uint16(lowest + jump)
    lowest_here = np.uint16(65535)
    for p in range(len(cost)):
        moved = np.uint16(min(before[p], before[p + 2]) + small)
        path = np.uint16(np.uint16(min(min(before[p + 1], cap), moved) - lowest) + cost[p])
        after[p + 1] = path
        total[p] = np.uint16(total[p] + path)
        lowest_here = min(lowest_here, path)
    return lowest_here


@njit(cache=True, parallel=True, nogil=True, error_model="numpy", fastmath=FAST)
def along_rows(mean: U16, across: U16, step: int, total: U16) -> None:
    """The sum of the paths from the left and from the right."""
    height, width, planes = mean.shape
    for task in prange((height + ROWS_AT_A_TIME - 1) // ROWS_AT_A_TIME):
        begin = task * ROWS_AT_A_TIME
        rows = min(ROWS_AT_A_TIME, height - begin)
        total[begin : begin + rows] = np.uint16(0)
        paths = np.empty((2, rows, planes + 2), np.uint16)
        lowest = np.empty(rows, np.uint16)
        for direction in range(2):
            paths[:] = _UNREACHABLE
            paths[0, :, 1 : planes + 1] = 0
            lowest[:] = 0
            for i in range(width):
                x = i if direction == 0 else width - 1 - i
                # The penalty lies between x and the pixel before it on the path.
                link = x if direction == 0 else min(x + 1, width - 1)
                for row in range(rows):
                    y = begin + row
                    lowest[row] = _extend(
                        mean[y, x],
                        paths[i & 1, row],
                        paths[(i + 1) & 1, row],
                        total[y, x],
                        lowest[row],
                        step,
                        across[y, link],
                    )


@njit(cache=True, parallel=True, nogil=True, error_model="numpy", fastmath=FAST)
def along_columns(mean: U16, down: U16, step: int, total: U16) -> None:
    """Adds the paths from the top and from the bottom."""
    height, width, planes = mean.shape
    for strip in prange(STRIPS):
        begin = strip * width // STRIPS
        columns = (strip + 1) * width // STRIPS - begin
        paths = np.empty((2, columns, planes + 2), np.uint16)
        lowest = np.empty(columns, np.uint16)
        for direction in range(2):
            paths[:] = _UNREACHABLE
            paths[0, :, 1 : planes + 1] = 0
            lowest[:] = 0
            for i in range(height):
                y = i if direction == 0 else height - 1 - i
                link = y if direction == 0 else min(y + 1, height - 1)
                for column in range(columns):
                    x = begin + column
                    lowest[column] = _extend(
                        mean[y, x],
                        paths[i & 1, column],
                        paths[(i + 1) & 1, column],
                        total[y, x],
                        lowest[column],
                        step,
                        down[link, x],
                    )

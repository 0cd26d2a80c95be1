"""Semi-global smoothing of the cost volume (Hirschmueller, PAMI 2008), our addition.

Along four directions each pixel's costs are joined with those of the pixel before it:
staying on the plane is free, moving to the next costs little, a jump costs more, and less
where the image has an edge. It sees farther than a window where texture is weak, and it
lets depth jump at the outlines of boxes rather than within half a window of them.
"""

from __future__ import annotations

import numpy as np
from numba import njit, prange
from numpy.typing import NDArray

from airground.config import PlaneSweep as Parameters
from airground.dense.aggregation import MEAN_SCALE
from airground.dense.workspace import Workspace

FAST = {"contract", "reassoc", "arcp", "nsz"}
STRIPS = 16
"""Columns are shared out in this many strips for the vertical directions."""


def smooth(
    mean: NDArray[np.uint16],
    reference: NDArray[np.float32],
    parameters: Parameters,
    workspace: Workspace,
) -> NDArray[np.uint16]:
    """Sum over four directions of the costs of the cheapest path that ends at each pixel.

    Args:
        mean: (height, width, planes) uint16, costs in 1/128 of a grey level.
        reference: (height, width) float32, the image whose edges make jumps cheap.
        parameters: With the penalties.
        workspace: Where the result is taken from.

    Returns:
        (height, width, planes) uint16. Path costs are counted from the path's cheapest
        plane before, so that they stay below cost + jump penalty and the sum fits.
    """
    total = workspace.take(mean.shape)
    step = int(MEAN_SCALE * parameters.step_penalty)
    jump, edge = MEAN_SCALE * parameters.jump_penalty, parameters.edge_levels
    along_rows(mean, reference, step, jump, edge, total)
    along_columns(mean, reference, step, jump, edge, total)
    return total


@njit(cache=True, error_model="numpy", fastmath=FAST)
def _extend(
    cost: NDArray, before: NDArray, after: NDArray, total: NDArray, step: int, jump: int
) -> None:
    """One pixel of one path; `before` and `after` have one guard at either end."""
    planes = len(cost)
    lowest = np.uint16(65535)
    middle = before[1 : planes + 1]
    for p in range(planes):
        lowest = min(lowest, middle[p])
    near, far, out = before[:planes], before[2 : planes + 2], after[1 : planes + 1]
    small, cap = np.uint16(step), np.uint16(lowest + np.uint16(jump))
    for p in range(planes):
        moved = np.uint16(min(near[p], far[p]) + small)
        path = np.uint16(np.uint16(min(min(middle[p], cap), moved) - lowest) + cost[p])
        out[p] = path
        total[p] = np.uint16(total[p] + path)


@njit(cache=True, error_model="numpy")
def _jump(step: int, jump: float, edge: float, here: float, before: float) -> int:
    """The jump penalty between two neighbours, lower across an edge of the image."""
    return max(int(jump / (1.0 + abs(here - before) / edge)), step)


@njit(cache=True, parallel=True, nogil=True, error_model="numpy", fastmath=FAST)
def along_rows(
    mean: NDArray, image: NDArray, step: int, jump: float, edge: float, total: NDArray
) -> None:
    """The sum of the paths from the left and from the right."""
    height, width, planes = mean.shape
    for y in prange(height):
        total[y] = np.uint16(0)
        paths = np.empty((2, planes + 2), np.uint16)
        for direction in range(2):
            paths[:] = np.uint16(30000)
            paths[0, 1 : planes + 1] = 0
            for i in range(width):
                x = i if direction == 0 else width - 1 - i
                last = x if i == 0 else (x - 1 if direction == 0 else x + 1)
                penalty = _jump(step, jump, edge, image[y, x], image[y, last])
                _extend(
                    mean[y, x],
                    paths[i & 1],
                    paths[(i + 1) & 1],
                    total[y, x],
                    step,
                    penalty,
                )


@njit(cache=True, parallel=True, nogil=True, error_model="numpy", fastmath=FAST)
def along_columns(
    mean: NDArray, image: NDArray, step: int, jump: float, edge: float, total: NDArray
) -> None:
    """Adds the paths from the top and from the bottom."""
    height, width, planes = mean.shape
    for strip in prange(STRIPS):
        begin = strip * width // STRIPS
        columns = (strip + 1) * width // STRIPS - begin
        paths = np.empty((2, columns, planes + 2), np.uint16)
        for direction in range(2):
            paths[:] = np.uint16(30000)
            paths[0, :, 1 : planes + 1] = 0
            for i in range(height):
                y = i if direction == 0 else height - 1 - i
                last = y if i == 0 else (y - 1 if direction == 0 else y + 1)
                for c in range(columns):
                    x = begin + c
                    penalty = _jump(step, jump, edge, image[y, x], image[last, x])
                    _extend(
                        mean[y, x],
                        paths[i & 1, c],
                        paths[(i + 1) & 1, c],
                        total[y, x],
                        step,
                        penalty,
                    )

"""Sums over the overlap of a turned aerial height map with the ground's (see `cost_kernels`).

A turned aerial cell falls between four cells of the ground map. Each four lie side by side in
memory: looking them up would take most of the time."""

from __future__ import annotations

import numpy as np
from numba import njit, prange

from airground.core.arrays import F32, F64, FAST, U32
from airground.localization.cost_kernels import mean_height

BLOCK = 512
"""Cells that are placed, looked up and added up at a time, so that they stay in the cache."""
MARGIN = 2
"""Empty cells around the heights: a place outside is moved there, where nothing counts."""


@njit(cache=True, nogil=True, error_model="numpy")
def filled_cells(heights: F32, first_x: int, first_y: int) -> tuple[F32, float]:
    """The filled cells (3, K) of an aerial map: x, y [cells], height about the mean; the mean.

    `heights` (nx, ny) [m] have NaN in holes; cell [0, 0] is `first_x`, `first_y` off the camera."""
    mean, count = mean_height(heights)
    cells = np.empty((3, count), np.float32)
    k = 0
    for i in range(heights.shape[0]):
        for j in range(heights.shape[1]):
            if heights[i, j] == heights[i, j]:
                cells[0, k], cells[1, k] = i + first_x, j + first_y
                cells[2, k] = heights[i, j] - np.float32(mean)
                k += 1
    return cells, mean


@njit(cache=True, nogil=True, error_model="numpy")
def in_fours(heights: F32) -> tuple[F32, float]:
    """Ground heights (nx, ny) [m] about their mean, each with its neighbours; the mean [m].

    The result is (nx + 4, ny + 4, 4): each cell, the next of its row, and the two behind these in
    the next row; NaN in holes and in `MARGIN` cells around."""
    mean, _ = mean_height(heights)
    nx, ny = heights.shape
    rows, columns = nx + 2 * MARGIN, ny + 2 * MARGIN
    about = np.full((rows + 1, columns + 1), np.float32(np.nan), np.float32)
    for i in range(nx):
        for j in range(ny):
            about[i + MARGIN, j + MARGIN] = heights[i, j] - np.float32(mean)
    fours = np.empty((rows, columns, 4), np.float32)
    for i in range(rows):
        here, behind, four = about[i], about[i + 1], fours[i]
        for j in range(columns):
            four[j, 0], four[j, 1] = here[j], here[j + 1]
            four[j, 2], four[j, 3] = behind[j], behind[j + 1]
    return fours, mean


@njit(cache=True, parallel=True, nogil=True, error_model="numpy", fastmath=FAST)
def sums_at_poses(cells: F32, fours: F32, poses: F64) -> F64:
    """The six sums (M, 6) for M poses of a turned aerial map.

    Args:
        cells: (3, K) cells from `filled_cells`.
        fours: (rows, columns, 4) heights from `in_fours`.
        poses: (M, 3) position of the camera in `fours` [cells], and heading [rad].
    """
    sums = np.zeros((len(poses), 6))
    rows, columns, _ = fours.shape
    # Two float32 travel as one number of 8 bytes.
    packed = fours.reshape(4 * rows * columns).view(np.float64)
    last = np.float32(rows - 2), np.float32(columns - 2)
    for p in prange(len(poses)):
        place = np.float32(poses[p, 0]), np.float32(poses[p, 1])
        turn = np.float32(np.cos(poses[p, 2])), np.float32(np.sin(poses[p, 2]))
        index = np.empty(BLOCK, np.uint32)
        fractions = np.empty((2, BLOCK), np.float32)
        corners = np.empty(2 * BLOCK, np.float64)
        for begin in range(0, cells.shape[1], BLOCK):
            n = min(BLOCK, cells.shape[1] - begin)
            # One-dimensional slices: only these are known to be contiguous.
            x, y = cells[0, begin : begin + n], cells[1, begin : begin + n]
            _place_cells(x, y, place, turn, last, columns, index, fractions[0], fractions[1])
            _look_up(packed, index, n, corners)
            _add_cells(
                cells[2, begin : begin + n],
                fractions[0],
                fractions[1],
                corners.view(np.float32),
                sums[p],
            )
    return sums


@njit(cache=True, error_model="numpy", fastmath=FAST)
def _place_cells(
    cell_x: F32,
    cell_y: F32,
    place: tuple[np.float32, np.float32],
    turn: tuple[np.float32, np.float32],
    last: tuple[np.float32, np.float32],
    columns: int,
    index: U32,
    fraction_x: F32,
    fraction_y: F32,
) -> None:
    """Where cells fall in the ground map: flat index of the corner before, and the rest."""
    (x0, y0), (c, s), (last_x, last_y) = place, turn, last
    zero, stride = np.float32(0), np.int32(columns)
    for i in range(len(cell_x)):
        # Clamped to the empty edge, where nothing counts.
        x = min(max(x0 + c * cell_x[i] - s * cell_y[i], zero), last_x)
        y = min(max(y0 + s * cell_x[i] + c * cell_y[i], zero), last_y)
        ix, iy = np.int32(x), np.int32(y)
        fraction_x[i], fraction_y[i] = x - np.float32(ix), y - np.float32(iy)
        index[i] = np.uint32(np.int32(ix * stride) + iy)


@njit(cache=True, error_model="numpy")
def _look_up(packed: F64, index: U32, n: int, corners: F64) -> None:
    """The four heights around each of n places."""
    for i in range(n):
        four = 2 * index[i]
        corners[2 * i], corners[2 * i + 1] = packed[four], packed[four + 1]


@njit(cache=True, error_model="numpy", fastmath=FAST)
def _add_cells(aerial: F32, fraction_x: F32, fraction_y: F32, corners: F32, sums: F64) -> None:
    """Add cells to the sums, given their fractions and the ground at their four corners."""
    zero, half, one = np.float32(0), np.float32(0.5), np.float32(1)
    n, sum_a, sum_g, sum_aa, sum_gg, sum_ag = zero, zero, zero, zero, zero, zero
    for i in range(len(aerial)):
        wx, wy = fraction_x[i], fraction_y[i]
        g00, g01 = corners[4 * i], corners[4 * i + 1]
        g10, g11 = corners[4 * i + 2], corners[4 * i + 3]
        w11 = wx * wy
        w10, w01 = wx - w11, wy - w11
        w00 = one - wx - w01
        w00 = w00 if g00 == g00 else zero
        w01 = w01 if g01 == g01 else zero
        w10 = w10 if g10 == g10 else zero
        w11 = w11 if g11 == g11 else zero
        weight = w00 + w01 + w10 + w11
        height = w00 * (g00 if g00 == g00 else zero)
        height += w01 * (g01 if g01 == g01 else zero)
        height += w10 * (g10 if g10 == g10 else zero)
        height += w11 * (g11 if g11 == g11 else zero)
        valid = one if weight >= half else zero
        g = height / weight if weight >= half else zero
        a = valid * aerial[i]
        n += valid
        sum_a += a
        sum_g += g
        sum_aa += a * a
        sum_gg += g * g
        sum_ag += a * g
    sums[0] += n
    sums[1] += sum_a
    sums[2] += sum_g
    sums[3] += sum_aa
    sums[4] += sum_gg
    sums[5] += sum_ag

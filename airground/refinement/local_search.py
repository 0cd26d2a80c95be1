"""A start for ICP from rough guesses: height maps laid over each other nearby (Eq. 2)."""

from __future__ import annotations

import numpy as np
from numba import njit

from airground.config import Refinement
from airground.core.arrays import F32, F64, FAST, I64
from airground.core.belief import HeightMap
from airground.core.height_map import lattice_index, make_height_map
from airground.core.se3 import SE3

HEADING_STEP_DEG = 2.0
"""Step of the searched headings [deg]: half of it shifts the edge of a map of 4 m by one cell."""
MIN_OVERLAP = 0.5
MIN_CELLS = 50


def search_nearby(aerial: F64, ground: F32, start: SE3, config: Refinement) -> SE3 | None:
    """The level motion T_ground_aerial around a start whose height maps agree best.

    Searches shifts within the configured radius and headings within the configured angle, turned
    about the middle of the aerial points; the height follows from the mean difference (Delta z of
    Sec. VI-A). None where the maps do not overlap."""
    cells_per_m = config.local_search_cells_per_m
    ground_map = make_height_map(ground, cells_per_m)
    reach = int(np.ceil(config.local_search_radius_m * cells_per_m))
    centre = aerial.mean(axis=0)
    place = np.array([*(start @ centre)[:2], 0.0])
    steps = int(config.local_search_angle_deg / HEADING_STEP_DEG)
    turns_deg = HEADING_STEP_DEG * np.arange(-steps, steps + 1)
    best, lowest = None, np.inf
    for heading in start.heading() + np.deg2rad(turns_deg):
        turned = SE3.from_heading(heading)
        aerial_map = make_height_map((aerial - centre) @ turned.rotation.T + place, cells_per_m)
        cost, shift, height = _best_shift(aerial_map, ground_map, reach)
        if cost < lowest:
            lowest = cost
            target = np.array([*(place[:2] + shift / cells_per_m), height])
            best = SE3(turned.rotation, target - turned @ centre)
    return best


def _best_shift(aerial: HeightMap, ground: HeightMap, reach: int) -> tuple[float, I64, float]:
    """Lowest cost [m^2], its shift [cells] and height offset [m] within `reach` cells."""
    first = lattice_index(aerial) - lattice_index(ground)
    costs, counts, heights = _shift_costs(aerial.heights, ground.heights, first, reach)
    # An overlap much smaller than others nearby fits by chance.
    costs[counts < max(MIN_CELLS, MIN_OVERLAP * counts.max())] = np.inf
    ix, iy = np.unravel_index(np.argmin(costs), costs.shape)
    return float(costs[ix, iy]), np.array([ix, iy]) - reach, float(heights[ix, iy])


@njit(cache=True, nogil=True, error_model="numpy")
def _shift_costs(aerial: F32, ground: F32, first: I64, reach: int) -> tuple[F64, F64, F64]:
    """Eq. 2, overlapping cells and mean height difference for every shift; NaN is a hole."""
    side = 2 * reach + 1
    costs = np.full((side, side), np.inf)
    counts = np.zeros((side, side))
    heights = np.zeros((side, side))
    for sx in range(side):
        for sy in range(side):
            x0, y0 = first[0] + sx - reach, first[1] + sy - reach
            low, high = max(0, -y0), min(aerial.shape[1], ground.shape[1] - y0)
            count, total, squares = 0.0, 0.0, 0.0
            for ix in range(max(0, -x0), min(aerial.shape[0], ground.shape[0] - x0)):
                if low < high:
                    sums = _row_sums(aerial[ix, low:high], ground[x0 + ix, y0 + low : y0 + high])
                    count += float(sums[0])
                    total += float(sums[1])
                    squares += float(sums[2])
            if count > 0:
                counts[sx, sy] = count
                heights[sx, sy] = total / count
                costs[sx, sy] = (squares / count - (total / count) ** 2) / 2
    return costs, counts, heights


@njit(cache=True, error_model="numpy", fastmath=FAST)
def _row_sums(aerial: F32, ground: F32) -> tuple[np.float32, np.float32, np.float32]:
    zero, one = np.float32(0), np.float32(1)
    count, total, squares = zero, zero, zero
    for i in range(len(aerial)):
        difference = ground[i] - aerial[i]
        seen = difference == difference
        difference = difference if seen else zero
        count += one if seen else zero
        total += difference
        squares += difference * difference
    return count, total, squares

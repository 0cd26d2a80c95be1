"""A start for ICP from rough guesses: height maps laid over each other nearby.

As in Sec. VI-A, but no difference of heights counts more than a tolerance: squares of those over
boxes that were moved, or sides that one robot has not seen, would decide where all else lies.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from airground.config import Refinement
from airground.core.arrays import F32, F64, FAST, I64
from airground.core.belief import HeightMap
from airground.core.height_map import lattice_index, make_height_map
from airground.core.se3 import SE3

STEPS_DEG = 4.0, 2.0
"""Step of the searched headings, and last step about the best of them [deg]: half of the last one
shifts the edge of a map of 4 m by one cell."""
MIN_OVERLAP = 0.5
MIN_CELLS = 50


def search_nearby(aerial: F64, ground: F32, start: SE3, config: Refinement) -> SE3 | None:
    """The level motion T_ground_aerial around a start whose height maps agree best.

    Searches shifts within the configured radius and headings within the configured angle, turned
    about the middle of the aerial points. The height is the one at which most cells agree (Delta z
    of Sec. VI-A). None where the maps do not overlap."""
    cells_per_m, level_m = config.local_search_cells_per_m, config.final_distance_m
    ground_map = make_height_map(ground, cells_per_m)
    centre = aerial.mean(axis=0)
    place = (start @ centre)[:2]

    def laid(heading: float, x: float, y: float) -> HeightMap:
        """The aerial points with their middle at x, y, 0."""
        turned = (aerial - centre) @ SE3.from_heading(heading).rotation.T
        return make_height_map(turned + np.array([x, y, 0.0]), cells_per_m)

    height = _height(laid(start.heading(), *place), ground_map, level_m)
    if height is None:
        return None
    step_deg, last_deg = STEPS_DEG
    steps = int(config.local_search_angle_deg / step_deg)
    all_deg = step_deg * np.arange(-steps, steps + 1)
    best, lowest = None, np.inf
    for turns_deg in (all_deg, np.array([-last_deg, last_deg])):
        around = start.heading() if best is None else best[0]
        for heading in around + np.deg2rad(turns_deg):
            cost, shift = _best_shift(laid(heading, *place), ground_map, height, config)
            if cost < lowest:
                best, lowest = (heading, *(place + shift / cells_per_m)), cost
    if best is None:
        return None
    heading, x, y = best
    height = _height(laid(heading, x, y), ground_map, level_m)
    if height is None:
        return None
    turned = SE3.from_heading(heading).rotation
    return SE3(turned, np.array([x, y, height]) - turned @ centre)


def _height(aerial: HeightMap, ground: HeightMap, level_m: float) -> float | None:
    """By how much [m] most of the aerial map is to be lifted: the mean of as many differences as
    lie within `level_m` of each other. None where the maps do not overlap."""
    first = lattice_index(aerial) - lattice_index(ground)
    low = np.maximum(first, 0)
    high = np.minimum(first + aerial.heights.shape, ground.heights.shape)
    if (low >= high).any():
        return None
    below = ground.heights[low[0] : high[0], low[1] : high[1]]
    low, high = low - first, high - first
    differences = below - aerial.heights[low[0] : high[0], low[1] : high[1]]
    ordered = np.sort(differences[np.isfinite(differences)])
    if len(ordered) == 0:
        return None
    ends = np.searchsorted(ordered, ordered + level_m, side="right")
    most = int((ends - np.arange(len(ordered))).argmax())
    return float(ordered[most : ends[most]].mean())


def _best_shift(
    aerial: HeightMap, ground: HeightMap, height: float, config: Refinement
) -> tuple[float, I64]:
    """Lowest cost [m] and its shift [cells], of the aerial map lifted by a height [m]."""
    reach = int(np.ceil(config.local_search_radius_m * config.local_search_cells_per_m))
    first = lattice_index(aerial) - lattice_index(ground)
    tolerance_m = config.local_search_tolerance_m
    lifted = aerial.heights + np.float32(height)
    costs, counts = _shift_costs(lifted, ground.heights, first, reach, np.float32(tolerance_m))
    # An overlap much smaller than others nearby fits by chance.
    costs[counts < max(MIN_CELLS, MIN_OVERLAP * counts.max())] = np.inf
    ix, iy = np.unravel_index(np.argmin(costs), costs.shape)
    return float(costs[ix, iy]), np.array([ix, iy]) - reach


@njit(cache=True, nogil=True, error_model="numpy")
def _shift_costs(
    aerial: F32, ground: F32, first: I64, reach: int, tolerance_m: np.float32
) -> tuple[F64, F64]:
    """Mean difference of heights, of which none counts more than the tolerance [m], and number of
    overlapping cells for every shift; NaN is a hole."""
    side = 2 * reach + 1
    costs = np.full((side, side), np.inf)
    counts = np.zeros((side, side))
    for sx in range(side):
        for sy in range(side):
            x0, y0 = first[0] + sx - reach, first[1] + sy - reach
            low, high = max(0, -y0), min(aerial.shape[1], ground.shape[1] - y0)
            count, total = 0.0, 0.0
            for ix in range(max(0, -x0), min(aerial.shape[0], ground.shape[0] - x0)):
                if low < high:
                    below = ground[x0 + ix, y0 + low : y0 + high]
                    sums = _row_sums(aerial[ix, low:high], below, tolerance_m)
                    count += float(sums[0])
                    total += float(sums[1])
            if count > 0:
                counts[sx, sy] = count
                costs[sx, sy] = total / count
    return costs, counts


@njit(cache=True, error_model="numpy", fastmath=FAST)
def _row_sums(aerial: F32, ground: F32, tolerance_m: np.float32) -> tuple[np.float32, np.float32]:
    zero, one = np.float32(0), np.float32(1)
    count, total = zero, zero
    for i in range(len(aerial)):
        difference = abs(ground[i] - aerial[i])
        seen = difference == difference
        count += one if seen else zero
        total += min(difference, tolerance_m) if seen else zero
    return count, total

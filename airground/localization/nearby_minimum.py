"""The pose near a belief at which the heights fit best.

A few degrees of heading change the cost by less than sigma of Eq. 5, so particles spread over them.
The place of the lowest cost is off by the cells that cannot fit, of boxes seen from one side or
changed since, as their squares outweigh all others. So the last search truncates the differences.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import product

import numpy as np
from numba import njit

from airground.core.arrays import F32, F64
from airground.core.belief import HeightMap
from airground.core.height_map import lattice_index
from airground.localization.particles import MODE_RADIUS_M
from airground.localization.turned_kernels import filled_cells

STEPS = ((0.08, 3.0), (0.04, 1.5), (0.02, 0.75), (0.01, 0.375))
"""Steps of the search in position [m] and heading [deg], halved to a quarter of a cell."""
MAX_TURN_DEG = 10.0
"""Largest turn away from the belief [deg]: twice the spread of particles at a right position."""
MAX_MOVES = 8
"""Largest number of moves with one step: more than reach the bounds."""
NEIGHBOURS = np.array(list(product((-1, 0, 1), repeat=3)), np.float64)
MOST_LOST = 6.0
"""Most cost that the second search may lose against the first, in sigma of Eq. 5: the area that
agrees changes by as much with a centimetre. Another place loses more."""
TRUNCATION_M = 0.1
"""Height difference from which on a cell counts as one that cannot fit [m]: several standard
deviations of both maps' heights, and less than most boxes are high. Chosen on two flights."""


def lowest_nearby(
    aerial: HeightMap,
    ground: HeightMap,
    estimate: F64,
    costs_at: Callable[[F64], F32],
    sigma: float,
) -> F64:
    """The pose (3,) around an estimate at which an aerial map fits best.

    Args:
        aerial: Heights around the MAV's camera, for heading 0.
        ground: Heights in the frame `ground`.
        estimate: x, y [m] of the camera and heading [rad], from that of `aerial`.
        costs_at: (M,) costs of poses (M, 3) as `estimate`; NaN where too little overlaps.
        sigma: Of Eq. 5, in the cost's units.

    Returns:
        A minimum within `MODE_RADIUS_M` and `MAX_TURN_DEG`; the estimate where too little overlaps.
        The second search counts only where it costs less than `MOST_LOST`.
    """
    cells, first = filled_cells(aerial.heights, *lattice_index(aerial))[0], lattice_index(ground)
    in_cells = np.array([ground.cells_per_m, ground.cells_per_m, 1.0])

    def costs(poses: F64, _: F64) -> F64:
        return costs_at(poses).astype(np.float64)

    def truncated(poses: F64, best: F64) -> F64:
        where = ground.heights, first.astype(np.float64)
        offset = np.nanmedian(differences(cells, *where, best * in_cells))
        return truncated_squares(cells, *where, poses * in_cells, float(offset))

    if not np.isfinite(costs(estimate[None], estimate)).all():
        return estimate
    guess = _descend(estimate, estimate, costs)
    found = _descend(guess, estimate, truncated)
    # Floor on floor has small differences everywhere: the structure must fit as before.
    before, after = costs(np.array([guess, found]), guess)
    return found if after <= before + MOST_LOST * sigma else guess


def _descend(start: F64, centre: F64, costs_of: Callable[[F64, F64], F64]) -> F64:
    """Move to the lowest neighbour while there is one, step by step finer, near a centre (3,).
    `costs_of` gives (M,) costs of poses (M, 3) around the best so far, NaN for impossible ones."""
    best = start
    for step_m, step_deg in STEPS:
        for _ in range(MAX_MOVES):
            poses = best + NEIGHBOURS * (step_m, step_m, np.deg2rad(step_deg))
            off = poses - centre
            near = np.hypot(off[:, 0], off[:, 1]) <= MODE_RADIUS_M
            poses = poses[near & (np.abs(off[:, 2]) <= np.deg2rad(MAX_TURN_DEG))]
            lowest = poses[int(np.nanargmin(costs_of(poses, best)))]
            if np.array_equal(lowest, best):
                break
            best = lowest
    return best


@njit(cache=True, nogil=True, error_model="numpy")
def differences(cells: F32, ground: F32, first: F64, pose: F64) -> F64:
    """(K,) ground minus aerial height at each aerial cell (3, K), NaN where there is no ground.
    `first` (2,) is the lattice index of `ground` [0, 0]; `pose` is x, y [cells], heading [rad]."""
    found = np.full(cells.shape[1], np.nan)
    c, s = np.cos(pose[2]), np.sin(pose[2])
    x0, y0 = pose[0] - first[0] + 0.5, pose[1] - first[1] + 0.5
    for i in range(cells.shape[1]):
        ix = int(np.floor(x0 + c * cells[0, i] - s * cells[1, i]))
        iy = int(np.floor(y0 + s * cells[0, i] + c * cells[1, i]))
        if 0 <= ix < ground.shape[0] and 0 <= iy < ground.shape[1]:
            found[i] = ground[ix, iy] - cells[2, i]
    return found


@njit(cache=True, nogil=True, error_model="numpy")
def truncated_squares(cells: F32, ground: F32, first: F64, poses: F64, offset: float) -> F64:
    """(M,) means of min((difference - offset)^2 / TRUNCATION_M^2, 1); 1 without any overlap."""
    means = np.ones(len(poses))
    for p in range(len(poses)):
        total, count = 0.0, 0
        off = differences(cells, ground, first, poses[p])
        for i in range(len(off)):
            if off[i] == off[i]:
                square = ((off[i] - offset) / TRUNCATION_M) ** 2
                total += min(square, 1.0)
                count += 1
        if count > 0:
            means[p] = total / count
    return means

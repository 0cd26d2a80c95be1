"""The pose near a belief at which the newest aerial maps together fit best.

A few degrees of heading change the cost of one map by less than sigma of Eq. 5, so particles spread
over them. All maps of a flight share one turn of `mav` in `ground`, which the MAV's SLAM keeps: the
sum of their costs has a sharper minimum. Its place is off by the cells that cannot fit, of boxes
seen from one side or changed since, as their squares outweigh all others. So the last search
truncates the differences.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import product

import numpy as np
from numba import njit

from airground.config import Localization
from airground.core.arrays import F32, F64
from airground.core.belief import HeightMap
from airground.core.height_map import lattice_index
from airground.localization.cost_map import overlay_turned
from airground.localization.particles import MODE_RADIUS_M
from airground.localization.turned_kernels import filled_cells

STEPS = ((0.08, 3.0), (0.04, 1.5), (0.02, 0.75), (0.01, 0.375))
"""Steps of the search in position [m] and heading [deg], halved to a quarter of a cell."""
MAX_TURN_DEG = 10.0
"""Largest turn away from the belief [deg]: twice the spread of particles at a right position."""
MAX_MOVES = 8
"""Largest number of moves with one step: more than reach the bounds."""
NEIGHBOURS = np.array(list(product((-1, 0, 1), repeat=3)), np.float64)
TRUNCATION_M = 0.1
"""Height difference from which on a cell counts as one that cannot fit [m]: several standard
deviations of both maps' heights, and less than most boxes are high. Chosen on two flights."""


@dataclass(frozen=True, eq=False)
class SightedHeights:
    """Height maps of one aerial surface and of the ground at its time.

    Attributes:
        aerial: Heights around the surface's camera, for heading 0.
        ground: Heights in the frame `ground`.
        position_mav: (3,) position of the surface's camera in `mav` [m].
    """

    aerial: HeightMap
    ground: HeightMap
    position_mav: F64

    @cached_property
    def cells(self) -> F32:
        """(3, K) filled cells of the aerial map: x, y [cells], height about the mean [m]."""
        return filled_cells(self.aerial.heights, *lattice_index(self.aerial))[0]

    def poses_there(self, poses: F64, position_mav: F64) -> F64:
        """(M, 3) poses of this camera where that at `position_mav` has poses (M, 3)."""
        back = self.position_mav - position_mav
        c, s = np.cos(poses[:, 2]), np.sin(poses[:, 2])
        there = poses.copy()
        there[:, 0] += c * back[0] - s * back[1]
        there[:, 1] += s * back[0] + c * back[1]
        return there

    def costs(self, poses: F64, config: Localization) -> F64:
        """(M,) costs at poses of this camera, NaN where too little overlaps."""
        overlay = overlay_turned(self.aerial, self.ground, poses)
        return overlay.costs(config).astype(np.float64)

    def truncated(self, poses: F64, middle: F64) -> F64:
        """(M,) mean squared differences of the heights, truncated, in units of the truncation.
        Their offset is the median at the pose `middle` (3,)."""
        ground, first = self.ground.heights, lattice_index(self.ground).astype(np.float64)
        in_cells = np.array([self.ground.cells_per_m, self.ground.cells_per_m, 1.0])
        offset = np.nanmedian(differences(self.cells, ground, first, middle * in_cells))
        return truncated_squares(self.cells, ground, first, poses * in_cells, float(offset))


def lowest_nearby(sighted: Sequence[SightedHeights], estimate: F64, config: Localization) -> F64:
    """The pose (3,) around an estimate at which several aerial maps together cost least.

    Args:
        sighted: The aerial maps, the newest last.
        estimate: x, y [m] of the newest camera and heading [rad].
        config: Section `localization`; the heading is searched.

    Returns:
        A minimum within `MODE_RADIUS_M` and `MAX_TURN_DEG`; the estimate where no map overlaps
        enough. Maps that overlap too little where a search starts do not count in it. The second
        search counts only where it costs less than sigma of the correlation.
    """
    position = sighted[-1].position_mav

    def with_overlap(pose: F64) -> list[SightedHeights]:
        there = [one.poses_there(pose[None], position) for one in sighted]
        pairs = zip(sighted, there, strict=True)
        return [one for one, poses in pairs if np.isfinite(one.costs(poses, config)).all()]

    def costs(poses: F64, _: F64) -> F64:
        found = [one.costs(one.poses_there(poses, position), config) for one in maps]
        total: F64 = np.sum(found, axis=0)
        return total

    def truncated(poses: F64, best: F64) -> F64:
        stacked = np.vstack([best, poses])
        there = [one.poses_there(stacked, position) for one in maps]
        pairs = zip(maps, there, strict=True)
        total: F64 = np.sum([one.truncated(moved[1:], moved[0]) for one, moved in pairs], axis=0)
        return total

    maps = with_overlap(estimate)
    if not maps:
        return estimate
    guess = _descend(estimate, estimate, costs)
    maps = with_overlap(guess)
    found = _descend(guess, estimate, truncated)
    # Floor on floor has small differences everywhere: the structure must fit as before.
    before, after = costs(np.array([guess, found]), guess) / len(maps)
    return found if after <= before + config.sigma else guess


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

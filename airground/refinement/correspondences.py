"""Nearest points for a cloud that moves a little at a time, without a search for each of them."""

from __future__ import annotations

import numpy as np
from numba import njit

from airground.core.arrays import F64, I64
from airground.refinement.surfels import Surfels

CANDIDATES = 6
"""Neighbours that are kept of each point: with 6 an alignment searches for an eighth of the points,
with 2 for two fifths; a search for 8 takes as long in all."""
SLACK_M = 1e-9
"""Far more than the rounding of a distance [m]."""


class Correspondences:
    """Nearest points of a target to source points, which keep their number and order.

    Each point was searched for at an anchor, with its nearest `CANDIDATES` neighbours. No other
    point of the target can come nearer than the distance of the last of these less the motion since
    then. While one of the neighbours is nearer than that, it is the nearest of all.

    Args:
        target: The points to find.
        count: Number of source points.
    """

    def __init__(self, target: Surfels, count: int) -> None:
        self._target = target
        self._anchors = np.zeros((count, 3))
        self._neighbours = np.zeros((count, CANDIDATES), np.int64)
        # Nothing is known yet: no neighbour is nearer than 0.
        self._nearest, self._farthest = np.zeros(count), np.zeros(count)

    def nearest(self, moved: F64, within_m: float) -> tuple[I64, F64]:
        """(N,) index of the nearest point of the target for each of the points (N, 3) [m], and (N,)
        squared distance to it [m^2]; infinite for some that are farther than `within_m`."""
        target = self._target
        if len(target) < CANDIDATES:
            return target.nearest(moved)
        index, squared, again = _proven(
            moved, self._anchors, self._neighbours, self._nearest, self._farthest,
            target.points, within_m,
        )  # fmt: skip
        if len(again):
            anchors = moved[again]
            neighbours, found = target.neighbours(anchors, CANDIDATES)
            index[again], squared[again] = neighbours[:, 0], found[:, 0]
            self._anchors[again], self._neighbours[again] = anchors, neighbours
            self._nearest[again], self._farthest[again] = np.sqrt(found[:, [0, -1]]).T
        return index, squared


@njit(cache=True, nogil=True, error_model="numpy")
def _proven(
    moved: F64,
    anchors: F64,
    neighbours: I64,
    nearest: F64,
    farthest: F64,
    targets: F64,
    within_m: float,
) -> tuple[I64, F64, I64]:
    """Nearest points that follow from earlier searches, their squared distances, and the indices of
    the points that have to be searched for again."""
    index = np.zeros(len(moved), np.int64)
    squared = np.full(len(moved), np.inf)
    again = np.empty(len(moved), np.int64)
    count = 0
    for i in range(len(moved)):
        x, y, z = moved[i, 0], moved[i, 1], moved[i, 2]
        dx, dy, dz = x - anchors[i, 0], y - anchors[i, 1], z - anchors[i, 2]
        step = np.sqrt(dx * dx + dy * dy + dz * dz) + SLACK_M
        if farthest[i] > 0 and nearest[i] - step > within_m:
            index[i] = neighbours[i, 0]
            continue
        least = np.inf
        for k in range(CANDIDATES):
            j = neighbours[i, k]
            dx, dy, dz = x - targets[j, 0], y - targets[j, 1], z - targets[j, 2]
            # In the order of small_gicp, so that the last bit is the same.
            candidate = (dx * dx + dz * dz) + dy * dy
            if candidate < least:
                least, index[i] = candidate, j
        if np.sqrt(least) + step < farthest[i]:
            squared[i] = least
        else:
            again[count] = i
            count += 1
    return index, squared, again[:count]

"""Point-to-plane ICP with a falling correspondence distance, trimmed at last (Sec. VII)."""

from __future__ import annotations

import numpy as np
from numba import njit

from airground.config import Refinement
from airground.core.arrays import F64, I64, Mask
from airground.core.se3 import SE3
from airground.refinement.correspondences import Correspondences
from airground.refinement.surfels import Surfels

SETTLED = 0.002
"""Largest motion of a point by the last step, as a share of the final correspondence distance: at
5 cm a tenth of a millimetre, far below the accuracy of an alignment."""
MIN_CORRESPONDENCES = 50
"""Least number of correspondences for a step: six unknowns, with room for outliers."""
SPARSE, SPARSE_ABOVE = 3, 2.0
"""Only every third point is used while the correspondence distance is larger than this many times
the final one."""


def point_to_plane_icp(source: F64, target: Surfels, start: SE3, config: Refinement) -> SE3:
    """Move points (N, 3) [m] until the distances along the target's normals are least.
    Returns T_target_source; the last motion found where the correspondences do not suffice."""
    motion = start
    distance = config.max_distance_m
    # The distance falls by a constant factor over two thirds of the steps, then stays.
    falling = max(1, (2 * config.iterations) // 3)
    factor = (config.final_distance_m / config.max_distance_m) ** (1.0 / falling)
    sparse_above_m = SPARSE_ABOVE * config.final_distance_m
    settled_m = SETTLED * config.final_distance_m
    # While the distance is still large, a part of the points says as much as all.
    some = source[::SPARSE] if distance > sparse_above_m else source
    found = Correspondences(target, len(some))
    for _ in range(config.iterations):
        if len(some) < len(source) and distance <= sparse_above_m:
            some = source
            found = Correspondences(target, len(some))
        moved = motion @ some
        index, squared = found.nearest(moved, distance)
        at_final = distance <= config.final_distance_m * 1.001
        # Nothing is trimmed before: on a floor with one box, the box is farthest off at first, and
        # alone shows where to move.
        keep = _closest(squared, distance, config.trim if at_final else 1.0)
        if keep.sum() < MIN_CORRESPONDENCES:
            break
        step = _solve(moved, target, index, keep)
        motion = step @ motion
        if at_final and np.abs(step @ moved[keep] - moved[keep]).max() < settled_m:
            break
        distance = max(distance * factor, config.final_distance_m)
    return motion


def _closest(squared: F64, distance: float, share: float) -> Mask:
    """Correspondences within the distance, and of these the closest share."""
    near = squared < distance * distance
    if near.any() and share < 1:
        near &= squared <= np.quantile(squared[near], share)
    return near


def _solve(moved: F64, target: Surfels, index: I64, keep: Mask) -> SE3:
    """The small motion that least squares of the point-to-plane distances asks for, over the kept
    correspondences: points (N, 3) and the index of each one's nearest point in the target."""
    centre, matrix, vector = _normal_equations(moved, target.points, target.normals, index, keep)
    # A little damping holds directions still that no plane constrains.
    matrix += 1e-6 * np.trace(matrix) * np.eye(6)
    delta = np.linalg.solve(matrix, vector)
    turn = SE3.from_rotation_vector(delta[:3])
    return SE3(turn.rotation, centre + delta[3:] - turn.rotation @ centre)


@njit(cache=True, nogil=True, error_model="numpy")
def _normal_equations(
    moved: F64, points: F64, normals: F64, index: I64, keep: Mask
) -> tuple[F64, F64, F64]:
    """The middle (3,) of the kept points, and sums over J^T J (6, 6) and -J^T r (6,) with
    J = [p x n, n] and r = n . (p - q), of p and q about the middle."""
    # Turning about the middle of the points keeps the normal equations well conditioned.
    centre = np.zeros(3)
    for i in range(len(moved)):
        if keep[i]:
            centre += moved[i]
    centre /= keep.sum()
    matrix = np.zeros((6, 6))
    vector = np.zeros(6)
    row = np.empty(6)
    p, q = np.empty(3), np.empty(3)
    for i in range(len(moved)):
        if not keep[i]:
            continue
        n = normals[index[i]]
        for axis in range(3):
            p[axis] = moved[i, axis] - centre[axis]
            q[axis] = points[index[i], axis] - centre[axis]
        row[0] = p[1] * n[2] - p[2] * n[1]
        row[1] = p[2] * n[0] - p[0] * n[2]
        row[2] = p[0] * n[1] - p[1] * n[0]
        row[3], row[4], row[5] = n[0], n[1], n[2]
        residual = n[0] * (p[0] - q[0]) + n[1] * (p[1] - q[1]) + n[2] * (p[2] - q[2])
        for j in range(6):
            vector[j] -= row[j] * residual
            for k in range(j, 6):
                matrix[j, k] += row[j] * row[k]
    for j in range(6):
        for k in range(j):
            matrix[j, k] = matrix[k, j]
    return centre, matrix, vector

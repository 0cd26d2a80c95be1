"""The camera's position with the rotation known from the gyro: two matches suffice (Sec. IV)."""

from __future__ import annotations

import numpy as np
from numba import njit

from airground.core.arrays import F64, I64, Mask
from airground.core.camera import PinholeCamera
from airground.core.se3 import SE3, nearest_rotation

MIN_MATCHES = 3
"""Two matches always agree with each other."""
REFINEMENTS = 4


def translation_by_known_rotation(
    points_map: F64,
    pixels: F64,
    camera: PinholeCamera,
    R_map_camera: F64,
    threshold_px: float,
    iterations: int,
    rng: np.random.Generator,
) -> tuple[SE3 | None, Mask]:
    """RANSAC over the camera's position, then least squares over the inliers.

    Args:
        points_map: (N, 3) points in the map [m].
        pixels: (N, 2) pixels of the points in the image.
        R_map_camera: (3, 3) known rotation.
        threshold_px: Largest distance between a pixel and its point's projection.
        iterations: Number of samples of two matches.

    Returns:
        The pose, None where no three matches agree, and (N,) the matches that agree.
    """
    n = len(points_map)
    if n < MIN_MATCHES:
        return None, np.zeros(n, bool)
    first = rng.integers(0, n, iterations)
    second = (first + rng.integers(1, n, iterations)) % n
    # In the camera's axes only the position is unknown, and the equations separate.
    points = np.ascontiguousarray(np.asarray(points_map, np.float64) @ R_map_camera)
    rays = np.empty((n, 2))
    rays[:, 0] = (pixels[:, 0] - camera.cx) / camera.fx
    rays[:, 1] = (pixels[:, 1] - camera.cy) / camera.fy
    threshold = threshold_px / np.sqrt(camera.fx * camera.fy)
    centre, inliers = _consensus(points, rays, first, second, threshold)
    if inliers.sum() < MIN_MATCHES or not np.isfinite(centre).all():
        return None, np.zeros(n, bool)
    return SE3(nearest_rotation(R_map_camera), R_map_camera @ centre), inliers


@njit(cache=True, nogil=True, error_model="numpy")
def _consensus(
    points: F64, rays: F64, first: I64, second: I64, threshold: float
) -> tuple[F64, Mask]:
    n = len(points)
    limit = threshold * threshold
    best, best_cost = np.full(3, np.nan), np.inf
    for s in range(len(first)):
        centre = _two_points(points, rays, first[s], second[s])
        cost = 0.0
        for i in range(n):
            cost += min(_square(points, rays, i, centre), limit)
            if cost >= best_cost:
                break
        # Errors count up to the threshold (MSAC), which discriminates better than counting.
        if cost < best_cost:
            best, best_cost = centre, cost
    inliers = np.zeros(n, np.bool_)
    for _ in range(REFINEMENTS):
        for i in range(n):
            inliers[i] = _square(points, rays, i, best) < limit
        if np.sum(inliers) < 2:
            break
        best = _least_squares(points, rays, inliers, best[2])
    for i in range(n):
        inliers[i] = _square(points, rays, i, best) < limit
    return best, inliers


@njit(cache=True, nogil=True, error_model="numpy")
def _square(points: F64, rays: F64, i: int, centre: F64) -> float:
    """Squared distance of a ray from its point's projection; infinite behind the camera."""
    z = points[i, 2] - centre[2]
    if not z > 0.0:
        return np.inf
    u = (points[i, 0] - centre[0]) / z - rays[i, 0]
    v = (points[i, 1] - centre[1]) / z - rays[i, 1]
    result: float = u * u + v * v
    return result


@njit(cache=True, nogil=True, error_model="numpy")
def _two_points(points: F64, rays: F64, i: int, j: int) -> F64:
    """The position c with c_xy - ray * c_z = point_xy - ray * point_z, least squares of four."""
    ui, vi, uj, vj = rays[i, 0], rays[i, 1], rays[j, 0], rays[j, 1]
    ai, bi = points[i, 0] - ui * points[i, 2], points[i, 1] - vi * points[i, 2]
    aj, bj = points[j, 0] - uj * points[j, 2], points[j, 1] - vj * points[j, 2]
    du, dv = ui - uj, vi - vj
    z = -(du * (ai - aj) + dv * (bi - bj)) / (du * du + dv * dv)
    centre = np.empty(3)
    centre[0] = 0.5 * (ai + aj) + 0.5 * (ui + uj) * z
    centre[1] = 0.5 * (bi + bj) + 0.5 * (vi + vj) * z
    centre[2] = z
    return centre


@njit(cache=True, nogil=True, error_model="numpy")
def _least_squares(points: F64, rays: F64, inliers: Mask, z: float) -> F64:
    """The same over all inliers; weights 1 / depth^2 turn metres into the image's errors."""
    total, su, sv, sa, sb = 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(len(points)):
        if inliers[i]:
            w = 1.0 / (points[i, 2] - z) ** 2
            u, v = rays[i, 0], rays[i, 1]
            total += w
            su += w * u
            sv += w * v
            sa += w * (points[i, 0] - u * points[i, 2])
            sb += w * (points[i, 1] - v * points[i, 2])
    mu, mv, ma, mb = su / total, sv / total, sa / total, sb / total
    above, below = 0.0, 0.0
    for i in range(len(points)):
        if inliers[i]:
            w = 1.0 / (points[i, 2] - z) ** 2
            u, v = rays[i, 0], rays[i, 1]
            du, dv = u - mu, v - mv
            above += w * du * (points[i, 0] - u * points[i, 2] - ma)
            above += w * dv * (points[i, 1] - v * points[i, 2] - mb)
            below += w * (du * du + dv * dv)
    centre = np.empty(3)
    centre[2] = -above / below
    centre[0], centre[1] = ma + mu * centre[2], mb + mv * centre[2]
    return centre

"""Points from two views, and how well their depth is known (Sec. IV)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit

from airground.core.arrays import F64, Mask, freeze
from airground.core.camera import PinholeCamera
from airground.core.se3 import SE3

ITERATIONS = 3

Poses = SE3 | tuple[F64, F64]
"""One `T_map_camera` for all points, or rotations (N, 3, 3) and positions (N, 3)."""


@dataclass(frozen=True, eq=False)
class Triangulated:
    """Points seen from two places.

    Attributes:
        points: (N, 3) points in the map [m]; NaN where not good.
        depth_a: (N,) depth along the optical axis of view a [m]; NaN where not good.
        inverse_depth_sigma: (N,) standard deviation of 1 / depth_a for noise of 1 px per axis in
            both views [1/m].
        parallax_rad: (N,) angle between the two rays.
        reprojection_px: (N,) the larger of the two distances between pixel and projection.
        good: (N,) bool, whether the rays cross in front of both cameras.
    """

    points: F64
    depth_a: F64
    inverse_depth_sigma: F64
    parallax_rad: F64
    reprojection_px: F64
    good: Mask

    def __post_init__(self) -> None:
        freeze(self, "points", (None, 3), np.float64)
        for name in ("depth_a", "inverse_depth_sigma", "parallax_rad", "reprojection_px"):
            freeze(self, name, (len(self.points),), np.float64)
        freeze(self, "good", (len(self.points),), np.bool_)


def triangulate_pairs(
    T_map_a: Poses, pixels_a: F64, T_map_b: Poses, pixels_b: F64, camera: PinholeCamera
) -> Triangulated:
    """The points with the least reprojection errors in two views.

    Too little parallax is no failure here; see `parallax_rad` and `inverse_depth_sigma`.

    Args:
        T_map_a: Pose of view a, for all points or for each.
        pixels_a: (N, 2) pixels in view a.
        T_map_b, pixels_b: Pose and pixels of view b, like those of view a.
    """
    n = len(pixels_a)
    R_a, t_a = _each(T_map_a, n)
    R_b, t_b = _each(T_map_b, n)
    k = np.array([camera.fx, camera.fy, camera.cx, camera.cy])
    pixels_a = np.ascontiguousarray(pixels_a, np.float64)
    pixels_b = np.ascontiguousarray(pixels_b, np.float64)
    return Triangulated(*_triangulate(R_a, t_a, pixels_a, R_b, t_b, pixels_b, k))


def _each(poses: Poses, n: int) -> tuple[F64, F64]:
    rotations, positions = (poses.rotation, poses.translation) if isinstance(poses, SE3) else poses
    return (
        np.ascontiguousarray(np.broadcast_to(rotations, (n, 3, 3)), np.float64),
        np.ascontiguousarray(np.broadcast_to(positions, (n, 3)), np.float64),
    )


@njit(cache=True, nogil=True, error_model="numpy")
def _triangulate(
    R_a: F64, t_a: F64, pixels_a: F64, R_b: F64, t_b: F64, pixels_b: F64, k: F64
) -> tuple[F64, F64, F64, F64, F64, Mask]:
    n = len(pixels_a)
    points, depth, sigma = np.full((n, 3), np.nan), np.full(n, np.nan), np.full(n, np.nan)
    parallax, error, good = np.full(n, np.nan), np.full(n, np.nan), np.zeros(n, np.bool_)
    for i in range(n):
        R = R_b[i].T @ R_a[i]
        t = R_b[i].T @ (t_a[i] - t_b[i])
        # A point is its ray through view a and its inverse depth there: (u, v, rho).
        x = np.empty(3)
        x[0] = (pixels_a[i, 0] - k[2]) / k[0]
        x[1] = (pixels_a[i, 1] - k[3]) / k[1]
        ub, vb = (pixels_b[i, 0] - k[2]) / k[0], (pixels_b[i, 1] - k[3]) / k[1]
        x[2] = _linear_inverse_depth(R, t, x[0], x[1], ub, vb)
        parallax[i] = _angle(R, x[0], x[1], ub, vb)
        for _ in range(ITERATIONS):
            step, sigma[i], _ = _gauss_newton(R, t, x, pixels_a[i], pixels_b[i], k)
            x += step
        _, sigma[i], error[i] = _gauss_newton(R, t, x, pixels_a[i], pixels_b[i], k)
        h_z = R[2, 0] * x[0] + R[2, 1] * x[1] + R[2, 2] + x[2] * t[2]
        good[i] = x[2] > 0.0 and h_z > 0.0 and np.isfinite(error[i])
        if good[i]:
            depth[i] = 1.0 / x[2]
            for j in range(3):
                ray = R_a[i, j, 0] * x[0] + R_a[i, j, 1] * x[1] + R_a[i, j, 2]
                points[i, j] = t_a[i, j] + depth[i] * ray
    return points, depth, sigma, parallax, error, good


@njit(cache=True, nogil=True, error_model="numpy")
def _linear_inverse_depth(R: F64, t: F64, u: float, v: float, ub: float, vb: float) -> float:
    """rho of R (u, v, 1) + rho t parallel to (ub, vb, 1), least squares of two equations."""
    x = R[0, 0] * u + R[0, 1] * v + R[0, 2]
    y = R[1, 0] * u + R[1, 1] * v + R[1, 2]
    z = R[2, 0] * u + R[2, 1] * v + R[2, 2]
    cu, cv = t[0] - ub * t[2], t[1] - vb * t[2]
    result: float = (cu * (ub * z - x) + cv * (vb * z - y)) / (cu * cu + cv * cv)
    return result


@njit(cache=True, nogil=True, error_model="numpy")
def _angle(R: F64, u: float, v: float, ub: float, vb: float) -> float:
    """Angle between the ray (u, v, 1) of view a and (ub, vb, 1) of view b [rad]."""
    x = R[0, 0] * u + R[0, 1] * v + R[0, 2]
    y = R[1, 0] * u + R[1, 1] * v + R[1, 2]
    z = R[2, 0] * u + R[2, 1] * v + R[2, 2]
    cx, cy, cz = y - z * vb, z * ub - x, x * vb - y * ub
    result: float = np.arctan2(np.sqrt(cx * cx + cy * cy + cz * cz), x * ub + y * vb + z)
    return result


@njit(cache=True, nogil=True, error_model="numpy")
def _gauss_newton(
    R: F64, t: F64, x: F64, pixel_a: F64, pixel_b: F64, k: F64
) -> tuple[F64, float, float]:
    """Step of (u, v, rho), sigma of rho for 1 px, and the larger error [px] before the step."""
    hx = R[0, 0] * x[0] + R[0, 1] * x[1] + R[0, 2] + x[2] * t[0]
    hy = R[1, 0] * x[0] + R[1, 1] * x[1] + R[1, 2] + x[2] * t[1]
    hz = R[2, 0] * x[0] + R[2, 1] * x[1] + R[2, 2] + x[2] * t[2]
    ub, vb = hx / hz, hy / hz
    au, av = k[0] * x[0] + k[2] - pixel_a[0], k[1] * x[1] + k[3] - pixel_a[1]
    bu, bv = k[0] * ub + k[2] - pixel_b[0], k[1] * vb + k[3] - pixel_b[1]
    J = np.empty((2, 3))
    for j in range(2):
        J[0, j] = k[0] * (R[0, j] - ub * R[2, j]) / hz
        J[1, j] = k[1] * (R[1, j] - vb * R[2, j]) / hz
    J[0, 2] = k[0] * (t[0] - ub * t[2]) / hz
    J[1, 2] = k[1] * (t[1] - vb * t[2]) / hz
    H = J.T @ J
    H[0, 0] += k[0] * k[0]
    H[1, 1] += k[1] * k[1]
    g0 = -(J[0, 0] * bu + J[1, 0] * bv) - k[0] * au
    g1 = -(J[0, 1] * bu + J[1, 1] * bv) - k[1] * av
    g2 = -(J[0, 2] * bu + J[1, 2] * bv)
    # Eliminate the ray: what is left is the information on rho alone.
    a, b, d = H[0, 0], H[0, 1], H[1, 1]
    det = a * d - b * b
    m0, m1 = (d * H[0, 2] - b * H[1, 2]) / det, (a * H[1, 2] - b * H[0, 2]) / det
    information = H[2, 2] - m0 * H[0, 2] - m1 * H[1, 2]
    step = np.empty(3)
    step[2] = (g2 - m0 * g0 - m1 * g1) / information
    q0, q1 = g0 - H[0, 2] * step[2], g1 - H[1, 2] * step[2]
    step[0], step[1] = (d * q0 - b * q1) / det, (a * q1 - b * q0) / det
    error = np.sqrt(max(au * au + av * av, bu * bu + bv * bv))
    return step, 1.0 / np.sqrt(max(information, 0.0)), error

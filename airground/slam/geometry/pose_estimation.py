"""The pose of one image from points of the map: robust least squares over six degrees (Sec. IV)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit

from airground.core.arrays import F64, Mask, freeze
from airground.core.camera import PinholeCamera
from airground.core.se3 import SE3, nearest_rotation
from airground.slam import so3
from airground.slam.geometry.cholesky import inverse, solve

MAX_PIXEL_CHI2 = 5.99
"""95 % of the squared norms of two normal variables are below."""
MAX_DEPTH_CHI2 = 3.84
"""95 % of the squares of one normal variable are below."""
ROBUST_ITERATIONS = 20
FINAL_ITERATIONS = 8
SETTLED = 1e-4
"""Steps below this share of a standard deviation change nothing."""
BEHIND_CHI2 = 1e4
"""Charged for a point behind the camera: a residual of 100 sigma, which no step can lower."""


@dataclass(frozen=True, eq=False)
class PoseFit:
    """A pose and how well it is known.

    Attributes:
        T_map_camera: Fitted pose.
        inliers: (N,) bool, whether a point's pixel agrees with the pose.
        rms_px: Root mean square reprojection error of the inliers [px]; NaN without inliers.
        covariance: (6, 6) covariance of the error in the map's axes: position [m], then rotation
            vector of estimate times inverse truth [rad]. NaN where inliers and priors leave a
            direction open.
        iterations: Number of steps taken.
    """

    T_map_camera: SE3
    inliers: Mask
    rms_px: float
    covariance: F64
    iterations: int

    def __post_init__(self) -> None:
        freeze(self, "inliers", (None,), np.bool_)
        freeze(self, "covariance", (6, 6), np.float64)


def estimate_pose(
    points_map: F64,
    pixels: F64,
    sigmas_px: F64,
    camera: PinholeCamera,
    T_map_camera_start: SE3,
    *,
    inverse_depths: F64 | None = None,
    inverse_depth_sigmas: F64 | None = None,
    rotation_sigma: float | None = None,
    position_sigma: float | None = None,
    T_map_camera_prior: SE3 | None = None,
    huber: float = 1.5,
) -> PoseFit:
    """Fit a pose to pixels, depths and priors: first all with Huber's cost, then the inliers.

    A point is an inlier by its pixel alone. A depth that disagrees, as along an edge, is
    left out without its pixel.

    Args:
        points_map: (N, 3) points in the map [m].
        pixels: (N, 2) pixels of the points in the image.
        sigmas_px: (N,) standard deviation of the pixels per axis [px].
        T_map_camera_start: First guess.
        inverse_depths: (N,) measured inverse depths [1/m], NaN without one; None without any.
        inverse_depth_sigmas: (N,) standard deviation of the inverse depths [1/m].
        rotation_sigma: Standard deviation of the prior's rotation per axis [rad]; None if unknown.
        position_sigma: Standard deviation of the prior's position per axis [m]; None if unknown.
        T_map_camera_prior: Mean of the priors; None for the first guess.
        huber: Number of sigmas above which residuals count linearly.

    Raises:
        ValueError: Inverse depths come without their sigmas.
    """
    n = len(points_map)
    if inverse_depths is None:
        inverse_depths, inverse_depth_sigmas = np.full(n, np.nan), np.ones(n)
    elif inverse_depth_sigmas is None:
        raise ValueError("inverse_depths need inverse_depth_sigmas")
    observed = np.empty((n, 8))
    observed[:, :3], observed[:, 3:5] = points_map, pixels
    observed[:, 5] = 1.0 / np.asarray(sigmas_px)
    observed[:, 6] = inverse_depths
    observed[:, 7] = 1.0 / np.asarray(inverse_depth_sigmas)
    prior_weights = np.array(
        [0.0 if s is None else 1.0 / s**2 for s in (position_sigma, rotation_sigma)]
    )
    prior = T_map_camera_start if T_map_camera_prior is None else T_map_camera_prior
    rotation, position, inliers, rms_px, covariance, iterations = _fit(
        observed,
        np.array([camera.fx, camera.fy, camera.cx, camera.cy]),
        np.array(T_map_camera_start.rotation),
        np.array(T_map_camera_start.translation),
        np.array(prior.rotation),
        np.array(prior.translation),
        prior_weights,
        huber,
    )
    pose = SE3(nearest_rotation(rotation), position)
    return PoseFit(pose, inliers, rms_px, covariance, iterations)


@njit(cache=True, nogil=True, error_model="numpy")
def _fit(
    observed: F64, k: F64, R: F64, p: F64, R0: F64, p0: F64, prior: F64, huber: float
) -> tuple[F64, F64, Mask, float, F64, int]:
    n = len(observed)
    use_pixel, use_depth = np.ones(n, np.bool_), np.isfinite(observed[:, 6])
    R, p, steps = _descend(
        observed, k, R, p, R0, p0, prior, huber, use_pixel, use_depth, ROBUST_ITERATIONS
    )
    _classify(observed, k, R, p, use_pixel, use_depth)
    R, p, more = _descend(
        observed, k, R, p, R0, p0, prior, np.inf, use_pixel, use_depth, FINAL_ITERATIONS
    )
    H, _, _ = _normal_equations(observed, k, R, p, R0, p0, prior, np.inf, use_pixel, use_depth)
    covariance = inverse(H)
    square = _classify(observed, k, R, p, use_pixel, use_depth)
    count = np.sum(use_pixel)
    return R, p, use_pixel, np.sqrt(square / count), covariance, steps + more


@njit(cache=True, nogil=True, error_model="numpy")
def _descend(
    observed: F64,
    k: F64,
    R: F64,
    p: F64,
    R0: F64,
    p0: F64,
    prior: F64,
    huber: float,
    use_pixel: Mask,
    use_depth: Mask,
    iterations: int,
) -> tuple[F64, F64, int]:
    """Levenberg-Marquardt: R <- exp(phi) @ R, p <- p + dp."""
    damping = 1e-6
    H, g, cost = _normal_equations(observed, k, R, p, R0, p0, prior, huber, use_pixel, use_depth)
    for step in range(iterations):
        damped = H.copy()
        for i in range(6):
            damped[i, i] += damping * H[i, i] + 1e-12
        delta, solved = solve(damped, g)
        if not solved:
            damping = max(10.0 * damping, 1e-3)
            continue
        R_new, p_new = so3.exp(delta[3:]) @ R, p + delta[:3]
        H_new, g_new, cost_new = _normal_equations(
            observed, k, R_new, p_new, R0, p0, prior, huber, use_pixel, use_depth
        )
        size = np.sqrt(max(np.dot(delta, H @ delta), 0.0))
        if cost_new <= cost:
            R, p, H, g, cost = R_new, p_new, H_new, g_new, cost_new
            damping = max(0.1 * damping, 1e-9)
        else:
            damping = max(10.0 * damping, 1e-3)
        if size < SETTLED:
            return R, p, step + 1
    return R, p, iterations


@njit(cache=True, nogil=True, error_model="numpy")
def _normal_equations(
    observed: F64,
    k: F64,
    R: F64,
    p: F64,
    R0: F64,
    p0: F64,
    prior: F64,
    huber: float,
    use_pixel: Mask,
    use_depth: Mask,
) -> tuple[F64, F64, float]:
    """J^T W J (6, 6), -J^T W r (6,) and the cost, for (position, left rotation)."""
    H, g, cost = np.zeros((6, 6)), np.zeros(6), 0.0
    row = np.empty(6)
    for i in range(len(observed)):
        if not use_pixel[i]:
            continue
        d0, d1, d2 = observed[i, 0] - p[0], observed[i, 1] - p[1], observed[i, 2] - p[2]
        x = R[0, 0] * d0 + R[1, 0] * d1 + R[2, 0] * d2
        y = R[0, 1] * d0 + R[1, 1] * d1 + R[2, 1] * d2
        z = R[0, 2] * d0 + R[1, 2] * d1 + R[2, 2] * d2
        if z < 1e-6:
            cost += _huber_cost(BEHIND_CHI2, huber)
            continue
        iz = 1.0 / z
        w = observed[i, 5]
        ru = (k[0] * x * iz + k[2] - observed[i, 3]) * w
        rv = (k[1] * y * iz + k[3] - observed[i, 4]) * w
        square = ru * ru + rv * rv
        weight = 1.0 if square <= huber * huber else huber / np.sqrt(square)
        cost += _huber_cost(square, huber)
        fu, fv = k[0] * iz * w, k[1] * iz * w
        _row(row, R, d0, d1, d2, fu, 0.0, -fu * x * iz)
        _add(H, g, row, ru, weight)
        _row(row, R, d0, d1, d2, 0.0, fv, -fv * y * iz)
        _add(H, g, row, rv, weight)
        if use_depth[i]:
            r = (iz - observed[i, 6]) * observed[i, 7]
            weight = 1.0 if abs(r) <= huber else huber / abs(r)
            cost += _huber_cost(r * r, huber)
            _row(row, R, d0, d1, d2, 0.0, 0.0, -iz * iz * observed[i, 7])
            _add(H, g, row, r, weight)
    turn = so3.log(R @ R0.T)
    # log(exp(phi) @ R @ R0.T) moves by the left Jacobian's inverse, the right one's at -turn.
    J = so3.right_jacobian_inverse(-turn)
    H[3:, 3:] += prior[1] * (J.T @ J)
    g[3:] -= prior[1] * (J.T @ turn)
    for j in range(3):
        H[j, j] += prior[0]
        g[j] -= prior[0] * (p[j] - p0[j])
        cost += prior[0] * (p[j] - p0[j]) ** 2 + prior[1] * turn[j] ** 2
    for j in range(6):
        for m in range(j):
            H[j, m] = H[m, j]
    return H, g, cost


@njit(cache=True, nogil=True, error_model="numpy")
def _huber_cost(square: float, huber: float) -> float:
    """Squared up to `huber`, linear beyond."""
    if square <= huber * huber:
        return square
    result: float = 2.0 * huber * np.sqrt(square) - huber * huber
    return result


@njit(cache=True, nogil=True, error_model="numpy")
def _row(row: F64, R: F64, d0: float, d1: float, d2: float, a: float, b: float, c: float) -> None:
    """Derivative of a residual whose derivative by the point in the camera is (a, b, c).
    The point R^T (X - p) moves by -R^T with p and by R^T hat(X - p) with a left turn."""
    n0 = R[0, 0] * a + R[0, 1] * b + R[0, 2] * c
    n1 = R[1, 0] * a + R[1, 1] * b + R[1, 2] * c
    n2 = R[2, 0] * a + R[2, 1] * b + R[2, 2] * c
    row[0], row[1], row[2] = -n0, -n1, -n2
    row[3] = n1 * d2 - n2 * d1
    row[4] = n2 * d0 - n0 * d2
    row[5] = n0 * d1 - n1 * d0


@njit(cache=True, nogil=True, error_model="numpy")
def _add(H: F64, g: F64, row: F64, residual: float, weight: float) -> None:
    """Add one weighted residual to the upper triangle of H and to g."""
    for j in range(6):
        scaled = weight * row[j]
        g[j] -= scaled * residual
        for m in range(j, 6):
            H[j, m] += scaled * row[m]


@njit(cache=True, nogil=True, error_model="numpy")
def _classify(observed: F64, k: F64, R: F64, p: F64, use_pixel: Mask, use_depth: Mask) -> float:
    """Mark pixels and depths that agree with a pose; returns the inliers' squared px."""
    total = 0.0
    for i in range(len(observed)):
        d = observed[i, :3] - p
        x = R[0, 0] * d[0] + R[1, 0] * d[1] + R[2, 0] * d[2]
        y = R[0, 1] * d[0] + R[1, 1] * d[1] + R[2, 1] * d[2]
        z = R[0, 2] * d[0] + R[1, 2] * d[1] + R[2, 2] * d[2]
        square = (k[0] * x / z + k[2] - observed[i, 3]) ** 2
        square += (k[1] * y / z + k[3] - observed[i, 4]) ** 2
        use_pixel[i] = z > 0.0 and square * observed[i, 5] ** 2 < MAX_PIXEL_CHI2
        depth_chi2 = ((1.0 / z - observed[i, 6]) * observed[i, 7]) ** 2
        use_depth[i] = use_pixel[i] and depth_chi2 < MAX_DEPTH_CHI2
        if use_pixel[i]:
            total += square
    return total

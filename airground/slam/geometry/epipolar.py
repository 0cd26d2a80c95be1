"""The relative pose of two views from their epipolar constraint, points eliminated.

A ray is (u, v), for the direction (u, v, 1) in its camera's axes. The residual is Sampson's:
to first order the distance by which both pixels must move for their rays to meet (Hartley and
Zisserman, "Multiple View Geometry", 2nd ed., Sec. 11.4.3), here over the noise's sigma.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from airground.core.arrays import F64, I64, Mask
from airground.slam import so3
from airground.slam.geometry.cholesky import inverse, solve

ROUNDS = 4
"""Inliers are chosen anew this often while the pose settles."""
ITERATIONS = 8
HUBER = 1.5
STEP = 1e-6
MAX_CHI2 = 3.84
"""95 % of the squares of one normal variable are below."""


@njit(cache=True, nogil=True, error_model="numpy")
def essential(R: F64, t: F64) -> F64:
    """E with ray_a^T E ray_b = 0 for T_a_b = (R, t)."""
    return so3.hat(t) @ R


@njit(cache=True, nogil=True, error_model="numpy")
def sampson(E: F64, ua: float, va: float, ub: float, vb: float) -> float:
    """Signed first-order distance of two rays from meeting, in units of u and v."""
    lx = E[0, 0] * ub + E[0, 1] * vb + E[0, 2]
    ly = E[1, 0] * ub + E[1, 1] * vb + E[1, 2]
    lz = E[2, 0] * ub + E[2, 1] * vb + E[2, 2]
    mx = E[0, 0] * ua + E[1, 0] * va + E[2, 0]
    my = E[0, 1] * ua + E[1, 1] * va + E[2, 1]
    norm = np.sqrt(lx * lx + ly * ly + mx * mx + my * my)
    result: float = (ua * lx + va * ly + lz) / norm
    return result


@njit(cache=True, nogil=True, error_model="numpy")
def direction_by_two_rays(
    rays_a: F64, rays_b: F64, R: F64, first: I64, second: I64, sigma: float
) -> F64:
    """RANSAC over the direction of translation when the rotation is known.

    Each pair of rays spans a plane that holds the translation; two planes cross in it.

    Args:
        rays_a, rays_b: (N, 2) rays of both views.
        R: (3, 3) rotation of T_a_b.
        first, second: (S,) indices of the sampled rays.
        sigma: Standard deviation of a residual, with the rotation's error.

    Returns:
        (3,) of length 1, its sign arbitrary; NaN where no sample spans two planes.
    """
    n = len(rays_a)
    normals = np.empty((n, 3))
    for i in range(n):
        x = R[0, 0] * rays_b[i, 0] + R[0, 1] * rays_b[i, 1] + R[0, 2]
        y = R[1, 0] * rays_b[i, 0] + R[1, 1] * rays_b[i, 1] + R[1, 2]
        z = R[2, 0] * rays_b[i, 0] + R[2, 1] * rays_b[i, 1] + R[2, 2]
        u, v = rays_a[i, 0], rays_a[i, 1]
        normals[i, 0], normals[i, 1], normals[i, 2] = v * z - y, x - u * z, u * y - v * x
    best, best_cost = np.full(3, np.nan), np.inf
    limit = MAX_CHI2 * sigma * sigma
    for s in range(len(first)):
        t = np.cross(normals[first[s]], normals[second[s]])
        length = np.sqrt(np.sum(t * t))
        if not length > 0.0:
            continue
        t /= length
        E = essential(R, t)
        cost = 0.0
        for i in range(n):
            r = sampson(E, rays_a[i, 0], rays_a[i, 1], rays_b[i, 0], rays_b[i, 1])
            cost += min(r * r, limit)
            if cost >= best_cost:
                break
        if cost < best_cost:
            best, best_cost = t, cost
    return best


@njit(cache=True, nogil=True, error_model="numpy")
def refine(
    rays_a: F64,
    rays_b: F64,
    R0: F64,
    t0: F64,
    start_sigma: float,
    sigma: float,
    rotation_sigma: float,
) -> tuple[F64, F64, Mask, F64]:
    """Least Sampson residuals of the inliers over rotation and direction of translation.

    Args:
        rays_a, rays_b: (N, 2) rays of both views.
        R0, t0: Start; R0 is also the mean of the rotation's prior.
        start_sigma: Standard deviation of a residual at the start, to choose the first inliers.
        sigma: Standard deviation of a residual.
        rotation_sigma: Standard deviation of the prior, per axis [rad]; infinite without one.

    Returns:
        R, t of length 1, inliers (N,), and the covariance (5, 5) of direction (two tangents)
        and rotation vector (left) [rad].
    """
    R, t = R0, t0 / np.sqrt(np.sum(t0 * t0))
    inliers = _choose(rays_a, rays_b, R, t, start_sigma)
    for _ in range(ROUNDS):
        R, t = _descend(rays_a, rays_b, inliers, R, t, R0, sigma, rotation_sigma)
        inliers = _choose(rays_a, rays_b, R, t, sigma)
    H, _, _ = _normal_equations(rays_a, rays_b, inliers, R, t, R0, sigma, rotation_sigma)
    return R, t, inliers, inverse(H)


@njit(cache=True, nogil=True, error_model="numpy")
def _choose(rays_a: F64, rays_b: F64, R: F64, t: F64, sigma: float) -> Mask:
    """Which pairs of rays meet within 1.96 sigma."""
    E = essential(R, t)
    inliers = np.zeros(len(rays_a), np.bool_)
    for i in range(len(rays_a)):
        r = sampson(E, rays_a[i, 0], rays_a[i, 1], rays_b[i, 0], rays_b[i, 1]) / sigma
        inliers[i] = r * r < MAX_CHI2
    return inliers


@njit(cache=True, nogil=True, error_model="numpy")
def _descend(
    rays_a: F64,
    rays_b: F64,
    inliers: Mask,
    R: F64,
    t: F64,
    R0: F64,
    sigma: float,
    rotation_sigma: float,
) -> tuple[F64, F64]:
    """Levenberg-Marquardt with Huber's cost."""
    damping = 1e-4
    H, g, cost = _normal_equations(rays_a, rays_b, inliers, R, t, R0, sigma, rotation_sigma)
    for _ in range(ITERATIONS):
        damped = H.copy()
        for i in range(5):
            damped[i, i] *= 1.0 + damping
        delta, solved = solve(damped, g)
        if not solved:
            damping = 10.0 * max(damping, 1e-4)
            continue
        R_new, t_new = _moved(R, t, delta)
        H_new, g_new, cost_new = _normal_equations(
            rays_a, rays_b, inliers, R_new, t_new, R0, sigma, rotation_sigma
        )
        gain = cost - cost_new
        if gain >= 0.0:
            R, t, H, g, cost = R_new, t_new, H_new, g_new, cost_new
            damping *= 0.1
            if gain < 1e-7 * cost:
                break
        else:
            damping = 10.0 * max(damping, 1e-4)
    return R, t


@njit(cache=True, nogil=True, error_model="numpy")
def _normal_equations(
    rays_a: F64,
    rays_b: F64,
    inliers: Mask,
    R: F64,
    t: F64,
    R0: F64,
    sigma: float,
    rotation_sigma: float,
) -> tuple[F64, F64, float]:
    """J^T W J (5, 5), -J^T W r (5,) and Huber's cost; derivatives by central differences."""
    plus, minus = np.empty((5, 3, 3)), np.empty((5, 3, 3))
    for j in range(5):
        delta = np.zeros(5)
        delta[j] = STEP
        plus[j] = essential(*_moved(R, t, delta))
        minus[j] = essential(*_moved(R, t, -delta))
    E = essential(R, t)
    H, g, cost, row = np.zeros((5, 5)), np.zeros(5), 0.0, np.empty(5)
    for i in range(len(rays_a)):
        if not inliers[i]:
            continue
        ua, va, ub, vb = rays_a[i, 0], rays_a[i, 1], rays_b[i, 0], rays_b[i, 1]
        r = sampson(E, ua, va, ub, vb) / sigma
        for j in range(5):
            row[j] = sampson(plus[j], ua, va, ub, vb) - sampson(minus[j], ua, va, ub, vb)
            row[j] /= 2.0 * STEP * sigma
        weight = 1.0 if abs(r) <= HUBER else HUBER / abs(r)
        cost += r * r if abs(r) <= HUBER else HUBER * (2.0 * abs(r) - HUBER)
        for j in range(5):
            g[j] -= weight * row[j] * r
            for m in range(5):
                H[j, m] += weight * row[j] * row[m]
    turn = so3.log(R @ R0.T)
    for j in range(3):
        H[2 + j, 2 + j] += 1.0 / rotation_sigma**2
        g[2 + j] -= turn[j] / rotation_sigma**2
        cost += turn[j] ** 2 / rotation_sigma**2
    return H, g, cost


@njit(cache=True, nogil=True, error_model="numpy")
def _moved(R: F64, t: F64, delta: F64) -> tuple[F64, F64]:
    """(R, t) turned: t by two angles across itself, R by a rotation vector on the left."""
    smallest = np.argmin(np.abs(t))
    axis = np.zeros(3)
    axis[smallest] = 1.0
    side = np.cross(t, axis)
    side /= np.sqrt(np.sum(side * side))
    moved = t + delta[0] * side + delta[1] * np.cross(t, side)
    return so3.exp(delta[2:]) @ R, moved / np.sqrt(np.sum(moved * moved))

"""Errors of reprojection and inverse depth, linearized.

A point X at offset d = X - p from the rig's position p moves in the camera by

    dx = R_camera_map (dX - dp + d x dphi)

when the rig turns by dphi in the map's axes (R <- exp(dphi) R, the same as R <- R exp(R' dphi)).
With A the residual's Jacobian by X, that by (dphi, dp) is therefore A G, G = [hat(d), -I]: all
that the normal equations need of an observation are B = A'WA, A'Wr and d.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from airground.core.arrays import F64, I64

MIN_DEPTH = 1e-3
"""Least depth of a point before the camera [m]."""
BEHIND_SIGMAS = 50.0
"""Residual that is charged for a point behind the camera [standard deviations]. It has no
gradient; a low cost would reward steps that turn points behind cameras."""
NUMBERS = 12
"""Numbers of a linearized observation: B (xx, xy, xz, yy, yz, zz), A'Wr (3), d (3)."""
FASTMATH = {"contract", "reassoc", "arcp", "nsz"}

Triple = tuple[float, float, float]


@njit(cache=True, nogil=True, error_model="numpy")
def huber(square: float, threshold: float) -> tuple[float, float]:
    """Cost and weight of a whitened residual of this squared norm."""
    if square <= threshold * threshold:
        return 0.5 * square, 1.0
    norm = np.sqrt(square)
    return threshold * (norm - 0.5 * threshold), threshold / norm


@njit(cache=True, nogil=True, error_model="numpy")
def camera_poses(
    rotations: F64, positions: F64, R_rig_camera: F64, t_rig_camera: F64
) -> tuple[F64, F64]:
    """`R_camera_map` (K, 3, 3) and the camera centres (K, 3) in the map."""
    count = len(rotations)
    turned = np.empty((count, 3, 3))
    centres = np.empty((count, 3))
    for k in range(count):
        turned[k] = R_rig_camera.T @ rotations[k].T
        centres[k] = positions[k] + rotations[k] @ t_rig_camera
    return turned, centres


@njit(cache=True, nogil=True, error_model="numpy", fastmath=FASTMATH)
def _into_camera(turn: F64, point: F64, centre: F64) -> Triple:
    """A point of the map in a camera that stands at `centre`."""
    x, y, z = point[0] - centre[0], point[1] - centre[1], point[2] - centre[2]
    return (
        turn[0, 0] * x + turn[0, 1] * y + turn[0, 2] * z,
        turn[1, 0] * x + turn[1, 1] * y + turn[1, 2] * z,
        turn[2, 0] * x + turn[2, 1] * y + turn[2, 2] * z,
    )


@njit(cache=True, nogil=True, error_model="numpy", fastmath=FASTMATH)
def _row(scale: float, along: F64, tangent: float, axis: F64) -> Triple:
    """One row of A: how a pixel coordinate follows the point."""
    return (
        scale * (along[0] - tangent * axis[0]),
        scale * (along[1] - tangent * axis[1]),
        scale * (along[2] - tangent * axis[2]),
    )


@njit(cache=True, nogil=True, error_model="numpy", fastmath=FASTMATH)
def _store(
    row: F64,
    a: Triple,
    b: Triple,
    c: Triple,
    error: Triple,
    w: float,
    q: float,
) -> None:
    """A'WA and A'Wr, A of the rows a and b of weight w and c of weight q, r weighted."""
    row[0] = w * (a[0] * a[0] + b[0] * b[0]) + q * c[0] * c[0]
    row[1] = w * (a[0] * a[1] + b[0] * b[1]) + q * c[0] * c[1]
    row[2] = w * (a[0] * a[2] + b[0] * b[2]) + q * c[0] * c[2]
    row[3] = w * (a[1] * a[1] + b[1] * b[1]) + q * c[1] * c[1]
    row[4] = w * (a[1] * a[2] + b[1] * b[2]) + q * c[1] * c[2]
    row[5] = w * (a[2] * a[2] + b[2] * b[2]) + q * c[2] * c[2]
    row[6] = a[0] * error[0] + b[0] * error[1] + c[0] * error[2]
    row[7] = a[1] * error[0] + b[1] * error[1] + c[1] * error[2]
    row[8] = a[2] * error[0] + b[2] * error[1] + c[2] * error[2]


@njit(cache=True, nogil=True, error_model="numpy", fastmath=FASTMATH)
def linearize(
    keyframes: I64,
    points_seen: I64,
    measured: F64,
    positions: F64,
    R_camera_map: F64,
    centres: F64,
    points: F64,
    camera: F64,
    threshold: float,
    out: F64,
) -> float:
    """The cost of all observations, and in `out` (M, NUMBERS) their linearization.

    Args:
        keyframes, points_seen: (M,) int64 indices of each observation.
        measured: (M, 5) x, y [px], 1 / sigma [1/px], inverse depth [1/m] or NaN, 1 / sigma [m].
        positions: (K, 3) positions of the rig [m].
        R_camera_map, centres: (K, 3, 3) and (K, 3) result of `camera_poses`.
        points: (P, 3) points in the map [m].
        camera: (4,) intrinsics fx, fy, cx, cy [px].
        threshold: Threshold of Huber's cost.
        out: (M, NUMBERS) result, overwritten.
    """
    fx, fy, cx, cy = camera[0], camera[1], camera[2], camera[3]
    behind, _ = huber(BEHIND_SIGMAS * BEHIND_SIGMAS, threshold)
    total = 0.0
    for m in range(len(keyframes)):
        k, j = keyframes[m], points_seen[m]
        r = R_camera_map[k]
        x, y, z = _into_camera(r, points[j], centres[k])
        row = out[m]
        if not z > MIN_DEPTH:
            row[:] = 0.0
            total += behind
            continue
        inverse = 1.0 / z
        u, v = x * inverse, y * inverse
        sharpness = measured[m, 2]
        eu = (fx * u + cx - measured[m, 0]) * sharpness
        ev = (fy * v + cy - measured[m, 1]) * sharpness
        cost, weight = huber(eu * eu + ev * ev, threshold)
        total += cost
        su, sv = fx * inverse * sharpness, fy * inverse * sharpness
        a, b = _row(su, r[0], u, r[2]), _row(sv, r[1], v, r[2])
        c, ed, depth_weight = (0.0, 0.0, 0.0), 0.0, 0.0
        if not np.isnan(measured[m, 3]):
            ed = (inverse - measured[m, 3]) * measured[m, 4]
            cost, depth_weight = huber(ed * ed, threshold)
            total += cost
            scale = -inverse * inverse * measured[m, 4]
            c = (scale * r[2, 0], scale * r[2, 1], scale * r[2, 2])
        _store(row, a, b, c, (weight * eu, weight * ev, depth_weight * ed), weight, depth_weight)
        for n in range(3):
            row[9 + n] = points[j, n] - positions[k, n]
    return total


@njit(cache=True, nogil=True, error_model="numpy")
def reprojection_errors_px(
    keyframes: I64,
    points_seen: I64,
    pixels: F64,
    R_camera_map: F64,
    centres: F64,
    points: F64,
    camera: F64,
) -> F64:
    """(M,) distance of each point from where it was seen [px]; NaN behind the camera."""
    errors = np.full(len(keyframes), np.nan)
    for m in range(len(keyframes)):
        k, j = keyframes[m], points_seen[m]
        x, y, z = _into_camera(R_camera_map[k], points[j], centres[k])
        if z > MIN_DEPTH:
            right = camera[0] * x / z + camera[2] - pixels[m, 0]
            down = camera[1] * y / z + camera[3] - pixels[m, 1]
            errors[m] = np.sqrt(right * right + down * down)
    return errors

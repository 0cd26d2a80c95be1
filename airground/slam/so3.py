"""Rotations and their tangent space, compiled.

Perturbations are on the right: `R @ exp(theta)`. Sola, Deray and Atchuthan, "A micro Lie
theory for state estimation in robotics", 2018.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from airground.core.arrays import F64

SMALL_ANGLE_SQUARED = 1e-8
"""Below this, three terms of the series are exact and the closed forms lose digits [rad^2]."""


@njit(cache=True, nogil=True, error_model="numpy")
def hat(v: F64) -> F64:
    """(3, 3) skew matrix with `hat(v) @ x = cross(v, x)`."""
    m = np.zeros((3, 3))
    m[0, 1], m[0, 2], m[1, 2] = -v[2], v[1], -v[0]
    m[1, 0], m[2, 0], m[2, 1] = v[2], -v[1], v[0]
    return m


@njit(cache=True, nogil=True, error_model="numpy")
def _combined(v: F64, constant: float, linear: float, squared: float) -> F64:
    """`constant * I + linear * hat(v) + squared * hat(v) @ hat(v)`."""
    x, y, z = v[0], v[1], v[2]
    m = np.empty((3, 3))
    m[0, 0] = constant - squared * (y * y + z * z)
    m[1, 1] = constant - squared * (x * x + z * z)
    m[2, 2] = constant - squared * (x * x + y * y)
    m[0, 1] = squared * x * y - linear * z
    m[1, 0] = squared * x * y + linear * z
    m[0, 2] = squared * x * z + linear * y
    m[2, 0] = squared * x * z - linear * y
    m[1, 2] = squared * y * z - linear * x
    m[2, 1] = squared * y * z + linear * x
    return m


@njit(cache=True, nogil=True, error_model="numpy")
def exp(v: F64) -> F64:
    """(3, 3) rotation by the vector `v` [rad]."""
    square = v[0] * v[0] + v[1] * v[1] + v[2] * v[2]
    if square < SMALL_ANGLE_SQUARED:
        return _combined(v, 1.0, 1.0 - square / 6.0, 0.5 - square / 24.0)
    angle = np.sqrt(square)
    half = np.sin(0.5 * angle)
    return _combined(v, 1.0, np.sin(angle) / angle, 2.0 * half * half / square)


@njit(cache=True, nogil=True, error_model="numpy")
def log(rotation: F64) -> F64:
    """(3,) rotation vector [rad] of a (3, 3) rotation; its length is at most pi."""
    r = rotation
    # Through the quaternion, whose largest component never vanishes: good near 0 and near pi.
    q = np.empty(4)
    trace = r[0, 0] + r[1, 1] + r[2, 2]
    if trace > 0.0:
        q[0] = 1.0 + trace
        q[1], q[2], q[3] = r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]
    else:
        i = 0
        if r[1, 1] > r[i, i]:
            i = 1
        if r[2, 2] > r[i, i]:
            i = 2
        j, k = (i + 1) % 3, (i + 2) % 3
        q[0] = r[k, j] - r[j, k]
        q[1 + i] = 1.0 + r[i, i] - r[j, j] - r[k, k]
        q[1 + j] = r[j, i] + r[i, j]
        q[1 + k] = r[k, i] + r[i, k]
    if q[0] < 0.0:
        q = -q
    vector = q[1:]
    sine = np.sqrt(vector[0] ** 2 + vector[1] ** 2 + vector[2] ** 2)
    if sine < 1e-9 * q[0]:
        turn: F64 = vector * (2.0 / q[0])
    else:
        turn = vector * (2.0 * np.arctan2(sine, q[0]) / sine)
    return turn


@njit(cache=True, nogil=True, error_model="numpy")
def right_jacobian(v: F64) -> F64:
    """(3, 3) J with `exp(v + d) = exp(v) @ exp(J @ d)` to first order in d."""
    square = v[0] * v[0] + v[1] * v[1] + v[2] * v[2]
    if square < SMALL_ANGLE_SQUARED:
        return _combined(v, 1.0, -0.5 + square / 24.0, 1.0 / 6.0 - square / 120.0)
    angle = np.sqrt(square)
    half = np.sin(0.5 * angle)
    cubic = (angle - np.sin(angle)) / (square * angle)
    return _combined(v, 1.0, -2.0 * half * half / square, cubic)


@njit(cache=True, nogil=True, error_model="numpy")
def right_jacobian_inverse(v: F64) -> F64:
    """(3, 3) J with `log(exp(v) @ exp(d)) = v + J @ d` to first order; |v| below 2 pi."""
    square = v[0] * v[0] + v[1] * v[1] + v[2] * v[2]
    if square < SMALL_ANGLE_SQUARED:
        return _combined(v, 1.0, 0.5, 1.0 / 12.0 + square / 720.0)
    half = 0.5 * np.sqrt(square)
    return _combined(v, 1.0, 0.5, (1.0 - half * np.cos(half) / np.sin(half)) / square)

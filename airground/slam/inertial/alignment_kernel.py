"""The compiled normal equations of a chain of keyframes with visual poses and inertial motions.

A keyframe has 15 unknowns (rotation, position, velocity, gyro's bias, accelerometer's bias);
only neighbours meet, so that their matrix is a band. All of them share three more: the
logarithm of the scale and gravity's two tilts, a border of the band.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numba import njit

from airground.core.arrays import F64, Mask
from airground.slam.so3 import exp, hat, log, right_jacobian, right_jacobian_inverse

STATE = 15
SHARED = 3
BAND = 2 * STATE
"""Diagonals stored of the band's lower half: a keyframe and the next."""


class Chain(NamedTuple):
    """The measurements of one chain of K keyframes.

    Attributes:
        rotations: (K, 3, 3) visual rotations `R_v_rig`.
        centres: (K, 3) centres of the camera [visual units].
        lever: (3,) position of the camera in the rig [m].
        linked: (K - 1,) whether the inertial motion to the next keyframe is known.
        durations: (K - 1,) durations of the inertial motions [s].
        turns, velocities, positions: (K - 1, 3, 3) and (K - 1, 3) inertial motions.
        jacobians: (K - 1, 5, 3, 3) derivatives by the biases, in the order of `Preintegration`.
        whitening: (K - 1, 9, 9) matrices that whiten the errors of the motions.
        gyro_biases, accelerometer_biases: (K - 1, 3) biases at the linearization.
        walks: (K - 1, 2) standard deviations of the biases' random walks.
        sigmas: (5,) standard deviations of visual rotation [rad] and position [visual units];
            then of the priors of velocity, gyro and accelerometer bias at a chain's start.
    """

    rotations: F64
    centres: F64
    lever: F64
    linked: Mask
    durations: F64
    turns: F64
    velocities: F64
    positions: F64
    jacobians: F64
    whitening: F64
    gyro_biases: F64
    accelerometer_biases: F64
    walks: F64
    sigmas: F64


@njit(cache=True, nogil=True, error_model="numpy")
def _scatter(jacobian: F64, residual: F64, first: int, band: F64, border: F64, top: F64) -> None:
    """Add J^T J and J^T r; the last columns of J are the shared ones.

    Args:
        jacobian: (m, n + 3) derivatives by the n unknowns from `first` on and by the shared ones.
        residual: (m,) residuals.
        first: Index of the first unknown.
        band: (30, 15 K) lower band of the matrix, `band[i - j, j]`.
        border: (15 K, 4) columns of the shared unknowns, and the gradient.
        top: (3, 4) block of the shared unknowns, and their gradient.
    """
    n = jacobian.shape[1] - SHARED
    product = jacobian.T @ jacobian
    gradient = jacobian.T @ residual
    for j in range(n):
        for i in range(j, n):
            band[i - j, first + j] += product[i, j]
        for i in range(SHARED):
            border[first + j, i] += product[j, n + i]
        border[first + j, SHARED] += gradient[j]
    for i in range(SHARED):
        for j in range(SHARED):
            top[i, j] += product[n + i, n + j]
        top[i, SHARED] += gradient[n + i]


@njit(cache=True, nogil=True, error_model="numpy")
def _inertial(
    chain: Chain, k: int, first: tuple[Any, ...], second: tuple[Any, ...], gravity: F64, tilts: F64
) -> tuple[F64, F64]:
    """(15,) white residual of motion and bias walk to the next keyframe, (15, 33) Jacobian."""
    R, p, v, gyro_bias, force_bias = first
    R2, p2, v2, gyro_bias2, force_bias2 = second
    J, dt = chain.jacobians[k], chain.durations[k]
    gyro = gyro_bias - chain.gyro_biases[k]
    force = force_bias - chain.accelerometer_biases[k]
    bend = J[0] @ gyro
    back = np.ascontiguousarray(R.T)
    error = exp(-bend) @ chain.turns[k].T @ back @ R2
    turn = log(error)
    sped = back @ (v2 - v - dt * gravity)
    moved = back @ (p2 - p - dt * v - 0.5 * dt * dt * gravity)
    motion = np.zeros(9)
    motion[:3] = turn
    motion[3:6] = sped - chain.velocities[k] - J[1] @ gyro - J[2] @ force
    motion[6:] = moved - chain.positions[k] - J[3] @ gyro - J[4] @ force

    D = np.zeros((9, 2 * STATE + SHARED))
    inverse = right_jacobian_inverse(turn)
    D[:3, 0:3] = -inverse @ R2.T @ R
    D[:3, 9:12] = -inverse @ error.T @ right_jacobian(bend) @ J[0]
    D[:3, 15:18] = inverse
    D[3:6, 0:3], D[6:, 0:3] = hat(sped), hat(moved)
    D[6:, 3:6], D[6:, 18:21] = -back, back
    D[3:6, 6:9], D[6:, 6:9], D[3:6, 21:24] = -back, -dt * back, back
    D[3:6, 9:12], D[6:, 9:12] = -J[1], -J[3]
    D[3:6, 12:15], D[6:, 12:15] = -J[2], -J[4]
    D[3:6, 31:], D[6:, 31:] = -dt * (back @ tilts), -0.5 * dt * dt * (back @ tilts)

    residual = np.empty(STATE)
    jacobian = np.zeros((STATE, 2 * STATE + SHARED))
    residual[:9] = chain.whitening[k] @ motion
    jacobian[:9] = chain.whitening[k] @ D
    for i in range(3):
        residual[9 + i] = (gyro_bias2[i] - gyro_bias[i]) / chain.walks[k, 0]
        residual[12 + i] = (force_bias2[i] - force_bias[i]) / chain.walks[k, 1]
        jacobian[9 + i, 9 + i], jacobian[9 + i, 24 + i] = (
            -1 / chain.walks[k, 0],
            1 / chain.walks[k, 0],
        )
        jacobian[12 + i, 12 + i], jacobian[12 + i, 27 + i] = (
            -1 / chain.walks[k, 1],
            1 / chain.walks[k, 1],
        )
    return residual, jacobian


@njit(cache=True, nogil=True, error_model="numpy")
def _visual(chain: Chain, k: int, R: F64, p: F64, unit: float) -> tuple[F64, F64]:
    """(6,) white residual of a visual pose, (6, 18) Jacobian; `unit` is 1 / scale."""
    turn = log(chain.rotations[k].T @ R)
    centre = unit * (p + R @ chain.lever)
    residual = np.empty(6)
    jacobian = np.zeros((6, STATE + SHARED))
    residual[:3] = turn / chain.sigmas[0]
    residual[3:] = (centre - chain.centres[k]) / chain.sigmas[1]
    jacobian[:3, :3] = right_jacobian_inverse(turn) / chain.sigmas[0]
    jacobian[3:, :3] = -unit / chain.sigmas[1] * (R @ hat(chain.lever))
    jacobian[3:, 3:6] = unit / chain.sigmas[1] * np.eye(3)
    jacobian[3:, STATE] = -centre / chain.sigmas[1]
    return residual, jacobian


@njit(cache=True, nogil=True, error_model="numpy")
def _prior(chain: Chain, v: F64, gyro: F64, force: F64) -> tuple[F64, F64]:
    """(9,) white residual of velocity and biases where a chain begins, (9, 18) Jacobian."""
    residual = np.empty(9)
    jacobian = np.zeros((9, STATE + SHARED))
    for i in range(3):
        residual[i], residual[3 + i] = v[i] / chain.sigmas[2], gyro[i] / chain.sigmas[3]
        residual[6 + i] = force[i] / chain.sigmas[4]
        for part in range(3):
            jacobian[3 * part + i, 6 + 3 * part + i] = 1.0 / chain.sigmas[2 + part]
    return residual, jacobian


@njit(cache=True, nogil=True, error_model="numpy")
def normal_equations(
    chain: Chain, rotations: F64, vectors: F64, unit: float, gravity: F64, tilts: F64
) -> tuple[F64, F64, F64, float]:
    """The band, its border with the gradient, the shared corner, and the sum of squares.

    Args:
        rotations: (K, 3, 3) rotations `R_v_rig`.
        vectors: (K, 4, 3) position, velocity, gyro's bias, accelerometer's bias [m].
        unit: 1 / scale: visual units in a metre.
        gravity: (3,) gravity in the axes of v [m/s^2].
        tilts: (3, 2) derivative of gravity by its two tilts.

    Returns:
        (30, 15 K) lower band, (15 K, 4), (3, 4), float.
    """
    count = len(rotations)
    band, border = np.zeros((BAND, STATE * count)), np.zeros((STATE * count, SHARED + 1))
    top = np.zeros((SHARED, SHARED + 1))
    cost = 0.0
    for k in range(count):
        p, v, gyro, force = vectors[k, 0], vectors[k, 1], vectors[k, 2], vectors[k, 3]
        residual, jacobian = _visual(chain, k, rotations[k], p, unit)
        _scatter(jacobian, residual, STATE * k, band, border, top)
        cost += float(residual @ residual)
        if k == 0 or not chain.linked[k - 1]:
            residual, jacobian = _prior(chain, v, gyro, force)
            _scatter(jacobian, residual, STATE * k, band, border, top)
            cost += float(residual @ residual)
        if k + 1 < count and chain.linked[k]:
            following = vectors[k + 1]
            residual, jacobian = _inertial(
                chain,
                k,
                (rotations[k], p, v, gyro, force),
                (rotations[k + 1], following[0], following[1], following[2], following[3]),
                gravity,
                tilts,
            )
            _scatter(jacobian, residual, STATE * k, band, border, top)
            cost += float(residual @ residual)
    return band, border, top, cost

"""A closed form for scale and gravity to begin with, from the shape of the inertial path.

Camera centres in visual units are a linear function of one inertial path: of where it began,
how fast, which way gravity pulled, what the accelerometer's bias added, and how many visual
units a metre has. The visual error stands on the left side only, so that noisy centres do not
draw the scale towards zero, as they do where accelerations are taken from them (as in Qin,
Li and Shen, "VINS-Mono", T-RO 2018, Sec. V-B).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from airground.core.arrays import F64, I64
from airground.slam import so3
from airground.slam.inertial.alignment_kernel import Chain
from airground.slam.inertial.preintegration import GRAVITY

ROUNDS = 5
"""Gravity's direction and the weight of the bias's prior settle in so many."""
PIECE_S = 4.0
"""The path begins anew so often: until then the accelerometer's noise stays at centimetres."""


@dataclass(frozen=True, eq=False)
class Start:
    """Start of the search.

    Attributes:
        unit: Visual units in a metre; not positive where the fit failed.
        unit_sigma: Relative standard deviation of the unit.
        gravity: (3,) gravity in the axes of v [m/s^2].
        velocities: (K, 3) velocities of the rig [m/s].
        gyro_bias, accelerometer_bias: (3,) biases [rad/s], [m/s^2].
    """

    unit: float
    unit_sigma: float
    gravity: F64
    velocities: F64
    gyro_bias: F64
    accelerometer_bias: F64


def tangent_basis(direction: F64) -> F64:
    """(3, 2) orthonormal vectors across `direction`."""
    return np.linalg.svd(direction[None])[2][1:].T


def gyro_bias_from_rotations(chain: Chain) -> F64:
    """(3,) bias with which the gyro turns as the camera did, to first order."""
    matrix, gradient = np.zeros((3, 3)), np.zeros(3)
    for k, turn in enumerate(chain.turns):
        jacobian = chain.jacobians[k, 0]
        error = so3.log(turn.T @ chain.rotations[k].T @ chain.rotations[k + 1])
        matrix += jacobian.T @ jacobian
        gradient += jacobian.T @ error
    prior = (chain.sigmas[0] / chain.sigmas[3]) ** 2 * np.eye(3)
    bias = chain.gyro_biases[0]
    result: F64 = bias + np.linalg.solve(matrix + prior, gradient - prior @ bias)
    return result


def closed_form(chain: Chain) -> Start:
    """Gyro's bias from rotations, then everything else from the camera centres; the chain has at
    least four keyframes, all linked."""
    gyro_bias = gyro_bias_from_rotations(chain)
    pieces, times = _pieces(chain.durations)
    speeds, path, speeds_by_bias, path_by_bias = _inertial_path(chain, gyro_bias, pieces)
    path = path + chain.rotations @ chain.lever
    ends = np.flatnonzero(np.append(np.diff(pieces) > 0, True))
    gravity = -speeds[ends].sum(axis=0)
    gravity *= GRAVITY / np.linalg.norm(gravity)
    half_squares = 0.5 * times**2
    # The columns: place and velocity where each piece begins, two tilts, the bias, the unit.
    begun = np.eye(pieces[-1] + 1)[pieces]
    begun = np.stack([begun, times[:, None] * begun], axis=1).reshape(len(times), -1)
    own = np.einsum("kc,ij->kicj", begun, np.eye(3)).reshape(len(times), 3, -1)
    n = own.shape[2]
    unit, bias_sigma = 1.0, 0.0
    for _ in range(ROUNDS):
        tilts = -so3.hat(gravity) @ tangent_basis(gravity)
        fallen = half_squares[:, None] * gravity
        shared = [half_squares[:, None, None] * tilts, path_by_bias, (path + fallen)[:, :, None]]
        rows = np.concatenate([own, *shared], axis=2).reshape(-1, n + 6) / chain.sigmas[1]
        # The bias counts in visual units, as all of this; in the first round it is zero.
        rows = np.concatenate([rows, np.eye(n + 6)[n + 2 : n + 5] / max(bias_sigma, 1e-9)])
        right = np.concatenate([chain.centres.ravel() / chain.sigmas[1], np.zeros(3)])
        fit = np.linalg.lstsq(rows, right, rcond=None)[0]
        unit = float(fit[-1])
        if not unit > 0.0:
            break
        gravity = gravity + tilts @ fit[n : n + 2] / unit
        gravity *= GRAVITY / np.linalg.norm(gravity)
        bias_sigma = chain.sigmas[4] * unit
    sigma = float(np.sqrt(np.linalg.pinv(rows.T @ rows)[-1, -1])) / abs(unit)
    bias = fit[n + 2 : n + 5] / unit
    began = fit[:n].reshape(2, -1, 3)[1, pieces] / unit
    velocities = began + speeds + times[:, None] * gravity + speeds_by_bias @ bias
    return Start(unit, sigma, gravity, velocities, gyro_bias, chain.accelerometer_biases[0] + bias)


def _pieces(durations: F64) -> tuple[I64, F64]:
    """(K,) number of the piece that each keyframe lies in, (K,) time since the piece began."""
    times = np.concatenate([[0.0], np.cumsum(durations)])
    count = max(1, round(times[-1] / PIECE_S))
    pieces = np.minimum(times * count / times[-1], count - 1).astype(np.int64)
    pieces = np.unique(pieces, return_inverse=True)[1]
    return pieces, times - times[np.searchsorted(pieces, pieces)]


def _inertial_path(chain: Chain, gyro_bias: F64, pieces: I64) -> tuple[F64, F64, F64, F64]:
    """(K, 3) velocity and position without gravity since each piece began at rest in the
    origin, (K, 3, 3) each by the bias."""
    count = len(chain.rotations)
    velocity, position = np.zeros((count, 3)), np.zeros((count, 3))
    velocity_by, position_by = np.zeros((count, 3, 3)), np.zeros((count, 3, 3))
    for k, dt in enumerate(chain.durations):
        if pieces[k + 1] > pieces[k]:
            continue
        R, J = chain.rotations[k], chain.jacobians[k]
        shift = gyro_bias - chain.gyro_biases[k]
        velocity[k + 1] = velocity[k] + R @ (chain.velocities[k] + J[1] @ shift)
        moved = R @ (chain.positions[k] + J[3] @ shift)
        position[k + 1] = position[k] + dt * velocity[k] + moved
        velocity_by[k + 1] = velocity_by[k] + R @ J[2]
        position_by[k + 1] = position_by[k] + dt * velocity_by[k] + R @ J[4]
    return velocity, position, velocity_by, position_by

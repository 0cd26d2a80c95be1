"""Errors of inertial motion between keyframes, linearized.

Forster, Carlone, Dellaert and Scaramuzza, "On-manifold preintegration for real-time
visual-inertial odometry", T-RO 2017, Eq. 44 and 45, and the random walk of the biases (Eq. 47);
Jacobians by rotations on the left, R <- exp(dphi) R, as in `residuals`.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numba import njit
from numpy.typing import ArrayLike

from airground.core.arrays import F64, I64
from airground.slam import so3
from airground.slam.bundle_adjustment.chain import place
from airground.slam.bundle_adjustment.problem import InertialFactor
from airground.slam.inertial.preintegration import GRAVITY_MAP

INTEGRATION_NOISE = 1e-6
"""Share by which every variance of a motion is raised: over a single step of integration
velocity and position have the same noise, and their covariance alone would be singular."""


class PackedMotions(NamedTuple):
    """All inertial factors, one array for each quantity.

    Attributes:
        firsts: (F,) keyframe in which each motion starts; it ends in the next.
        durations: (F,) durations of the motions [s].
        rotations: (F, 3, 3) rotations of the motions.
        velocities, positions: (F, 3) changes of velocity [m/s] and position [m].
        biases: (F, 6) biases of gyro and accelerometer at the linearization.
        by_biases: (F, 9, 6) derivatives of rotation, velocity and position by the biases.
        whitening: (F, 15, 15) matrices that turn a residual into one of unit covariance.
    """

    firsts: I64
    durations: F64
    rotations: F64
    velocities: F64
    positions: F64
    biases: F64
    by_biases: F64
    whitening: F64


def pack(factors: Sequence[InertialFactor]) -> PackedMotions:
    """Lay factors out for the kernel."""
    motions = [factor.preintegration for factor in factors]
    whitening = np.zeros((len(motions), 15, 15))
    # L with covariance = L L': its inverse makes the covariance one.
    covariances = _stack([m.covariance for m in motions], 9, 9)
    lower = np.linalg.cholesky(covariances * (1.0 + INTEGRATION_NOISE * np.eye(9)))
    whitening[:, :9, :9] = np.linalg.inv(lower)
    walks = [(m.gyro_bias_sigma, m.accelerometer_bias_sigma) for m in motions]
    whitening[:, range(9, 15), range(9, 15)] = np.repeat(1.0 / _stack(walks, 2), 3, axis=1)
    return PackedMotions(
        firsts=np.array([factor.first for factor in factors], np.int64),
        durations=_stack([m.duration_s for m in motions]),
        rotations=_stack([m.rotation for m in motions], 3, 3),
        velocities=_stack([m.velocity for m in motions], 3),
        positions=_stack([m.position for m in motions], 3),
        biases=_stack([[*m.gyro_bias, *m.accelerometer_bias] for m in motions], 6),
        by_biases=_stack([m.by_biases() for m in motions], 9, 6),
        whitening=whitening,
    )


def _stack(rows: Sequence[ArrayLike], *shape: int) -> F64:
    """(F, *shape), also where there are none."""
    return np.array(rows, np.float64).reshape(len(rows), *shape)


@njit(cache=True, nogil=True, error_model="numpy")
def motion_residual(
    first: F64, second: F64, R_first: F64, R_second: F64, motion: tuple[Any, ...], jacobian: F64
) -> F64:
    """(15,) residual of one motion: rotation, velocity, position, walk of the biases.

    Args:
        first, second: (12,) position, velocity, gyro bias and accelerometer bias of two keyframes.
        R_first, R_second: (3, 3) rotations of the keyframes.
        motion: Duration, rotation, velocity, position, biases and their Jacobians.
        jacobian: (15, 30) derivative by both keyframes' 15 unknowns, overwritten.
    """
    seconds, rotation, velocity, position, biases, by_biases = motion
    correction = by_biases @ (first[6:12] - biases)
    turn = rotation @ so3.exp(correction[0:3])
    back = np.ascontiguousarray(R_first.T)
    error = turn.T @ back @ R_second
    faster = second[3:6] - first[3:6] - seconds * GRAVITY_MAP
    farther = second[0:3] - first[0:3] - seconds * first[3:6]
    farther -= 0.5 * seconds * seconds * GRAVITY_MAP
    residual = np.empty(15)
    residual[0:3] = so3.log(error)
    residual[3:6] = back @ faster - velocity - correction[3:6]
    residual[6:9] = back @ farther - position - correction[6:9]
    residual[9:15] = second[6:12] - first[6:12]

    jacobian[:] = 0.0
    unrolled = so3.right_jacobian_inverse(residual[0:3])
    by_turn = unrolled @ np.ascontiguousarray(R_second.T)
    jacobian[0:3, 0:3] = -by_turn
    jacobian[0:3, 15:18] = by_turn
    gyro = so3.right_jacobian(correction[0:3]) @ np.ascontiguousarray(by_biases[0:3, 0:3])
    jacobian[0:3, 9:12] = -unrolled @ np.ascontiguousarray(error.T) @ gyro
    jacobian[3:6, 0:3] = back @ so3.hat(faster)
    jacobian[3:6, 6:9] = -back
    jacobian[3:6, 21:24] = back
    jacobian[6:9, 0:3] = back @ so3.hat(farther)
    jacobian[6:9, 3:6] = -back
    jacobian[6:9, 6:9] = -seconds * back
    jacobian[6:9, 18:21] = back
    jacobian[3:9, 9:15] = -by_biases[3:9]
    for n in range(6):
        jacobian[9 + n, 9 + n] = -1.0
        jacobian[9 + n, 24 + n] = 1.0
    return residual


@njit(cache=True, nogil=True, error_model="numpy")
def linearize_motions(
    firsts: I64,
    durations: F64,
    rotations: F64,
    velocities: F64,
    positions: F64,
    biases: F64,
    by_biases: F64,
    whitening: F64,
    R_map_rig: F64,
    vectors: F64,
    residuals: F64,
    jacobians: F64,
) -> float:
    """The cost of all motions; whitened `residuals` (F, 15) and `jacobians` (F, 15, 30).

    Args:
        firsts, ..., whitening: Fields of `PackedMotions`.
        R_map_rig: (K, 3, 3) rotations of the keyframes.
        vectors: (K, 12) position, velocity, gyro bias, accelerometer bias.
        residuals, jacobians: Results, overwritten.
    """
    total = 0.0
    jacobian = np.empty((15, 30))
    for n in range(len(firsts)):
        k = firsts[n]
        motion = (durations[n], rotations[n], velocities[n], positions[n], biases[n], by_biases[n])
        raw = motion_residual(
            vectors[k], vectors[k + 1], R_map_rig[k], R_map_rig[k + 1], motion, jacobian
        )
        residuals[n] = whitening[n] @ raw
        jacobians[n] = whitening[n] @ jacobian
        total += 0.5 * np.dot(residuals[n], residuals[n])
    return total


@njit(cache=True, nogil=True, error_model="numpy")
def add_motions(
    firsts: I64,
    slots: I64,
    residual: F64,
    jacobian: F64,
    poses: F64,
    chain: F64,
    links: F64,
    coupling: F64,
    gradient: F64,
    diagonal: F64,
) -> None:
    """Add J'J and J'r of the inertial factors."""
    moving = len(chain)
    for f in range(len(firsts)):
        transposed = np.ascontiguousarray(jacobian[f].T)
        product = transposed @ jacobian[f]
        toward = transposed @ residual[f]
        for one in range(2):
            s, i = slots[firsts[f] + one], 15 * one
            if s < 0:
                continue
            chain[s] += product[i + 6 : i + 15, i + 6 : i + 15]
            for n in range(15):
                at = place(s, moving, n)
                gradient[at] += toward[i + n]
                diagonal[at] += product[i + n, i + n]
            for other in range(2):
                t, j = slots[firsts[f] + other], 15 * other
                if t < 0:
                    continue
                # Neighbours in time have neighbouring slots.
                c = 6 * (t - s + 1)
                coupling[s, :, c : c + 6] += product[i + 6 : i + 15, j : j + 6]
                if t >= s:
                    pose, next_pose = 6 * s, 6 * t
                    poses[pose : pose + 6, next_pose : next_pose + 6] += product[
                        i : i + 6, j : j + 6
                    ]
                if t > s:
                    links[s] += product[i + 6 : i + 15, j + 6 : j + 15]

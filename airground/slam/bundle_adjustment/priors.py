"""What is known of single keyframes beforehand: gauge, rest, size of the biases."""

from __future__ import annotations

import numpy as np
from numba import njit

from airground.core.arrays import F64, I64
from airground.slam import so3
from airground.slam.bundle_adjustment.chain import place
from airground.slam.bundle_adjustment.problem import Role, Settings, States

ROWS = 13
"""Priors of a keyframe: position (3), heading, velocity (3), gyro and accelerometer bias (3, 3)."""
GAUGE_SIGMA = 1e-4
"""How tightly the gauge is held [m], [rad]: no observation competes with it, so that this is
as good as exact, and still well within the range of double precision."""


def prior_sharpness(states: States, roles: I64, firsts: I64, settings: Settings) -> F64:
    """(K, ROWS) one over the sigma of every prior; 0 where there is none.

    Args:
        roles: (K,) role of each keyframe.
        firsts: (F,) keyframe in which each inertial motion starts.
    """
    sharpness = np.zeros((len(states), ROWS))
    sharpness[roles == Role.GAUGE, 0:4] = 1.0 / GAUGE_SIGMA
    if states.still is not None:
        sharpness[states.still, 4:7] = 1.0 / settings.still_sigma
    # A keyframe that no motion leads to: nothing before it says anything about its biases.
    begins = np.setdiff1d(firsts, firsts + 1)
    if settings.gyro_bias_prior_sigma is not None:
        sharpness[begins, 7:10] = 1.0 / settings.gyro_bias_prior_sigma
    if settings.accelerometer_bias_prior_sigma is not None:
        sharpness[begins, 10:13] = 1.0 / settings.accelerometer_bias_prior_sigma
    sharpness[roles == Role.FIXED] = 0.0
    return sharpness


@njit(cache=True, nogil=True, error_model="numpy")
def linearize_priors(
    sharpness: F64,
    start_rotations: F64,
    start_vectors: F64,
    rotations: F64,
    vectors: F64,
    residuals: F64,
    headings: F64,
) -> float:
    """The cost of all priors; whitened `residuals` (K, ROWS) and `headings` (K, 3).

    All but the heading depend on one number of the state each; `headings` is how the heading
    changes with the keyframe's turn, whitened. Heading is the vertical part of the rotation
    vector that leads from the keyframe at the start to the one now.

    Args:
        sharpness: (K, ROWS) result of `prior_sharpness`.
        start_rotations, start_vectors: Estimate at which the gauge is held.
        rotations: (K, 3, 3) rotations of the keyframes.
        vectors: (K, 12) position, velocity, gyro bias, accelerometer bias.
        residuals, headings: Results, overwritten.
    """
    total = 0.0
    for k in range(len(sharpness)):
        sharp = sharpness[k]
        residual = residuals[k]
        headings[k] = 0.0
        residual[3] = 0.0
        if sharp[3] > 0.0:
            turn = so3.log(rotations[k] @ start_rotations[k].T)
            residual[3] = sharp[3] * turn[2]
            # The left Jacobian is the right one's transpose.
            headings[k] = sharp[3] * so3.right_jacobian_inverse(turn)[:, 2]
        for n in range(3):
            residual[n] = sharp[n] * (vectors[k, n] - start_vectors[k, n])
        for n in range(9):
            residual[4 + n] = sharp[4 + n] * vectors[k, 3 + n]
        total += 0.5 * np.dot(residual, residual)
    return total


@njit(cache=True, nogil=True, error_model="numpy")
def add_priors(
    sharpness: F64,
    slots: I64,
    residual: F64,
    headings: F64,
    poses: F64,
    chain: F64,
    gradient: F64,
    diagonal: F64,
) -> None:
    """Add J'J and J'r of the priors."""
    for k in range(len(slots)):
        if slots[k] < 0:
            continue
        s, turn = slots[k], 6 * slots[k]
        for i in range(3):
            gradient[turn + i] += headings[k, i] * residual[k, 3]
            diagonal[turn + i] += headings[k, i] ** 2
            for j in range(i, 3):
                poses[turn + i, turn + j] += headings[k, i] * headings[k, j]
        for n in range(12 if len(chain) else 3):
            row = n if n < 3 else n + 1
            at = place(s, len(chain), 3 + n)
            information = sharpness[k, row] ** 2
            gradient[at] += sharpness[k, row] * residual[k, row]
            diagonal[at] += information
            if n < 3:
                poses[at, at] += information
            else:
                chain[s, n - 3, n - 3] += information

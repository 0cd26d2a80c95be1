"""The compiled sum of inertial samples into one relative motion.

The method of `preintegration`, by the mean of both ends of each step (the midpoint rule).
"""

from __future__ import annotations

import numpy as np
from numba import njit

from airground.core.arrays import F64, I64
from airground.slam.so3 import exp, right_jacobian

Sums = tuple[F64, F64, F64, F64, F64, float]


@njit(cache=True, nogil=True, error_model="numpy")
def _interpolated(stamps: I64, readings: F64, stamp: int, after: int) -> F64:
    """(6,) reading at `stamp`, which lies before sample `after`; the nearest one at the ends."""
    if after == 0:
        reading: F64 = readings[0].copy()
    elif after == len(stamps):
        reading = readings[after - 1].copy()
    else:
        before = after - 1
        share = (stamp - stamps[before]) / (stamps[after] - stamps[before])
        reading = (1.0 - share) * readings[before] + share * readings[after]
    return reading


@njit(cache=True, nogil=True, error_model="numpy")
def _product(a: F64, b: F64, out: F64) -> None:
    """out = a @ b for (3, 3) and (3, n); BLAS takes longer to call than this to run."""
    for i in range(3):
        for j in range(b.shape[1]):
            out[i, j] = a[i, 0] * b[0, j] + a[i, 1] * b[1, j] + a[i, 2] * b[2, j]


@njit(cache=True, nogil=True, error_model="numpy")
def _turned_force(rotation: F64, force: F64, out: F64) -> None:
    """out = rotation @ hat(force): how the turned force changes with the rotation, negated."""
    x, y, z = force[0], force[1], force[2]
    for i in range(3):
        out[i, 0] = rotation[i, 1] * z - rotation[i, 2] * y
        out[i, 1] = rotation[i, 2] * x - rotation[i, 0] * z
        out[i, 2] = rotation[i, 0] * y - rotation[i, 1] * x


@njit(cache=True, nogil=True, error_model="numpy")
def _propagate(covariance: F64, turn: F64, lever: F64, dt: float, rows: F64, lean: F64) -> None:
    """covariance <- F covariance F^T, by F on the rows twice with a transpose in between, for
    one step's F = [turn^T 0 0; dt lever, 1, 0; dt^2/2 lever, dt, 1]."""
    turn_back = turn.T
    for _ in range(2):
        _product(turn_back, covariance[:3], rows)
        _product(lever, covariance[:3], lean)
        for i in range(3):
            for j in range(9):
                velocity = covariance[3 + i, j]
                covariance[i, j] = rows[i, j]
                covariance[3 + i, j] = velocity + dt * lean[i, j]
                covariance[6 + i, j] += dt * velocity + 0.5 * dt * dt * lean[i, j]
        for i in range(9):
            for j in range(i):
                covariance[i, j], covariance[j, i] = covariance[j, i], covariance[i, j]


@njit(cache=True, nogil=True, error_model="numpy")
def _add_noise(
    covariance: F64, jacobian: F64, tilt: F64, dt: float, gyro: float, force: float
) -> None:
    """Add the white noise of one step, shared by both its ends, with squared densities `gyro` and
    `force`. Turning the force's noise, alike on all axes, does not change it."""
    for i in range(3):
        for j in range(3):
            turned, swept, leant = 0.0, 0.0, 0.0
            for k in range(3):
                turned += jacobian[i, k] * jacobian[j, k]
                swept += tilt[i, k] * jacobian[j, k]
                leant += tilt[i, k] * tilt[j, k]
            turned, swept, leant = gyro * dt * turned, gyro * swept, gyro / dt * leant
            covariance[i, j] += turned
            covariance[3 + i, j] += dt * swept
            covariance[j, 3 + i] += dt * swept
            covariance[6 + i, j] += 0.5 * dt * dt * swept
            covariance[j, 6 + i] += 0.5 * dt * dt * swept
            white = leant + (force / dt if i == j else 0.0)
            covariance[3 + i, 3 + j] += dt * dt * white
            covariance[3 + i, 6 + j] += 0.5 * dt**3 * white
            covariance[6 + i, 3 + j] += 0.5 * dt**3 * white
            covariance[6 + i, 6 + j] += 0.25 * dt**4 * white


@njit(cache=True, nogil=True, error_model="numpy")
def _mean_force(
    rotation: F64,
    turned: F64,
    turn: F64,
    sweep: F64,
    reading: F64,
    following: F64,
    force: F64,
    lever: F64,
    tilt: F64,
    work: F64,
) -> None:
    """The mean force of a step in the start's frame, and how it changes.

    Args:
        rotation, turned: (3, 3) before and after the step, `turned = rotation @ turn`.
        turn: (3, 3) turn of the step.
        sweep: (3, 3) derivative of the turn by the rate.
        reading, following: (6,) readings before and after the step, without bias.
        force: (3,) mean force, set.
        lever: (3, 3) derivative of the force by the rotation before the step, set.
        tilt: (3, 3) derivative of the force by the rate, set.
        work: (3, 3) scratch.
    """
    _turned_force(turned, following[3:], work)
    _product(work, turn.T, lever)
    _product(work, sweep, tilt)
    _turned_force(rotation, reading[3:], work)
    for i in range(3):
        force[i] = 0.0
        for j in range(3):
            lever[i, j] = -0.5 * (lever[i, j] + work[i, j])
            tilt[i, j] *= -0.5
            force[i] += 0.5 * (rotation[i, j] * reading[3 + j] + turned[i, j] * following[3 + j])


@njit(cache=True, nogil=True, error_model="numpy")
def _add_step(
    velocity: F64,
    position: F64,
    jacobians: F64,
    dt: float,
    force: F64,
    leant: F64,
    turned_back: F64,
    tilt: F64,
    jacobian: F64,
    rotation: F64,
    turned: F64,
) -> None:
    """Add one step to velocity, position and their Jacobians.

    Args:
        dt: Length of the step [s].
        force: (3,) mean force.
        leant, turned_back: (3, 3) lever and transposed turn, times the rotation's Jacobian.
        tilt: (3, 3) derivative of the force by the rate.
        jacobian: (3, 3) right Jacobian of the turn.
        rotation, turned: (3, 3) rotations before and after the step.
    """
    for i in range(3):
        position[i] += dt * (velocity[i] + 0.5 * dt * force[i])
        velocity[i] += dt * force[i]
        for j in range(3):
            by_gyro = leant[i, j] - tilt[i, j]
            by_force = -0.5 * (rotation[i, j] + turned[i, j])
            jacobians[0, i, j] = turned_back[i, j] - dt * jacobian[i, j]
            jacobians[3, i, j] += dt * (jacobians[1, i, j] + 0.5 * dt * by_gyro)
            jacobians[4, i, j] += dt * (jacobians[2, i, j] + 0.5 * dt * by_force)
            jacobians[1, i, j] += dt * by_gyro
            jacobians[2, i, j] += dt * by_force


@njit(cache=True, nogil=True, error_model="numpy")
def preintegrate(
    stamps: I64,
    readings: F64,
    start: int,
    end: int,
    gyro_bias: F64,
    accelerometer_bias: F64,
    gyro_density: float,
    accelerometer_density: float,
) -> Sums:
    """Rotation, velocity, position, five Jacobians, covariance and the longest gap [s].

    Args:
        stamps: (N,) increasing stamps [ns]; N >= 1.
        readings: (N, 6) readings of gyro [rad/s] and accelerometer [m/s^2].
        start, end: The times between which to integrate [ns].
        gyro_bias, accelerometer_bias: (3,) biases to subtract from the readings.
        gyro_density, accelerometer_density: Densities of the white noise.

    Returns:
        (3, 3), (3,), (3,), (5, 3, 3), (9, 9), float. The Jacobians are of the rotation and
        velocity by the gyro's bias, of the velocity by the accelerometer's, of the position
        by both.
    """
    rotation, velocity, position = np.eye(3), np.zeros(3), np.zeros(3)
    jacobians, covariance = np.zeros((5, 3, 3)), np.zeros((9, 9))
    first = int(np.searchsorted(stamps, start, side="right"))
    last = int(np.searchsorted(stamps, end, side="left"))
    before, lever, tilt = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3))
    product, rows, lean = np.empty((3, 3)), np.empty((3, 9)), np.empty((3, 9))
    force = np.empty(3)
    reading, stamp = _interpolated(stamps, readings, start, first), start
    reading[:3] -= gyro_bias
    reading[3:] -= accelerometer_bias
    for index in range(first, last + 1):
        if index < last:
            following, next_stamp = readings[index].copy(), stamps[index]
        else:
            following, next_stamp = _interpolated(stamps, readings, end, last), end
        following[:3] -= gyro_bias
        following[3:] -= accelerometer_bias
        dt = (next_stamp - stamp) * 1e-9
        if dt <= 0.0:
            continue
        rate = 0.5 * (reading[:3] + following[:3])
        turn, jacobian = exp(dt * rate), right_jacobian(dt * rate)
        turned = np.empty((3, 3))
        _product(rotation, turn, turned)

        _mean_force(
            rotation, turned, turn, dt * jacobian, reading, following, force, lever, tilt, product
        )
        _propagate(covariance, turn, lever, dt, rows, lean)
        _add_noise(covariance, jacobian, tilt, dt, gyro_density**2, accelerometer_density**2)
        _product(lever, jacobians[0], before)
        _product(turn.T, jacobians[0], product)
        _add_step(
            velocity,
            position,
            jacobians,
            dt,
            force,
            before,
            product,
            tilt,
            jacobian,
            rotation,
            turned,
        )
        rotation, reading, stamp = turned, following, next_stamp
    return rotation, velocity, position, jacobians, covariance, _gap(stamps, start, end)


@njit(cache=True, nogil=True, error_model="numpy")
def _gap(stamps: I64, start: int, end: int) -> float:
    """The longest time between neighbouring samples that any of [start, end] lies in [s]."""
    first = max(int(np.searchsorted(stamps, start, side="right")) - 1, 0)
    last = min(int(np.searchsorted(stamps, end, side="left")), len(stamps) - 1)
    longest = max(stamps[0] - start, end - stamps[-1], 0)
    for index in range(first, last):
        longest = max(longest, stamps[index + 1] - stamps[index])
    result: float = longest * 1e-9
    return result

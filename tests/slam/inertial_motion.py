"""Analytic motions of a rig, and what a perfect or a noisy IMU reads on them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from airground.core.messages import ImuNoise, ImuSamples
from airground.slam.inertial.preintegration import GRAVITY_MAP

ADIS16448 = ImuNoise(1.6968e-4, 1.9393e-5, 2.0e-3, 3.0e-3)
"""EuRoC's sensor, as in its sensor.yaml."""

BIAS_SIGMAS = (5e-3, 5e-2)
"""Deviation of the biases of gyro [rad/s] and accelerometer [m/s^2], as in the simulator."""

Path = Callable[[NDArray], NDArray]
STEP = 1e-3


@dataclass(frozen=True)
class Motion:
    """A position [m] and a rotation vector [rad] over time [s], each (N,) -> (N, 3)."""

    position: Path
    rotation_vector: Path

    def rotations(self, t: NDArray) -> NDArray:
        return Rotation.from_rotvec(self.rotation_vector(t)).as_matrix()

    def velocities(self, t: NDArray) -> NDArray:
        f = self.position
        return (8 * (f(t + STEP) - f(t - STEP)) - f(t + 2 * STEP) + f(t - 2 * STEP)) / (12 * STEP)

    def imu(self, t: NDArray) -> tuple[NDArray, NDArray]:
        """(N, 3) angular rate and (N, 3) specific force in the rig, from fine differences."""
        f, h = self.position, 2 * STEP
        near, far = f(t + h) + f(t - h), f(t + 2 * h) + f(t - 2 * h)
        acceleration = (16 * near - far - 30 * f(t)) / (12 * h**2)
        R = Rotation.from_rotvec(self.rotation_vector(t))
        turn = [
            (
                Rotation.from_rotvec(self.rotation_vector(t - k * STEP)).inv()
                * Rotation.from_rotvec(self.rotation_vector(t + k * STEP))
            ).as_rotvec()
            / (2 * k * STEP)
            for k in (1, 2)
        ]
        return (4 * turn[0] - turn[1]) / 3, R.inv().apply(acceleration - GRAVITY_MAP)


@dataclass(frozen=True, eq=False)
class Reading:
    """Samples of an IMU and the biases that are in them, one row a sample."""

    samples: ImuSamples
    gyro_biases: NDArray = field(repr=False)
    accelerometer_biases: NDArray = field(repr=False)


def read_imu(
    motion: Motion,
    duration_s: float,
    rng: np.random.Generator | None,
    noise: ImuNoise = ADIS16448,
    rate_hz: float = 200.0,
    bias_sigmas: tuple[float, float] = BIAS_SIGMAS,
) -> Reading:
    """What an IMU reads from time 0 on, stamps from 1 s on; without `rng`, a perfect one."""
    stamps = np.arange(0, round(duration_s * rate_hz) + 1)
    gyro, force = motion.imu(stamps / rate_hz)
    gyro_bias = np.zeros_like(gyro)
    force_bias = np.zeros_like(gyro)
    if rng is not None:
        n = gyro.shape
        walk = np.cumsum(rng.normal(size=(2, *n)), axis=1) / np.sqrt(rate_hz)
        gyro_bias = rng.normal(0, bias_sigmas[0], 3) + noise.gyro_bias_walk * walk[0]
        force_bias = rng.normal(0, bias_sigmas[1], 3) + noise.accelerometer_bias_walk * walk[1]
        gyro = gyro + gyro_bias
        gyro = gyro + rng.normal(0, noise.gyro_noise_density * np.sqrt(rate_hz), n)
        force = force + force_bias
        force = force + rng.normal(0, noise.accelerometer_noise_density * np.sqrt(rate_hz), n)
    stamps_ns = to_ns(stamps / rate_hz)
    return Reading(ImuSamples(stamps_ns, gyro, force), gyro_bias, force_bias)


def to_ns(t: NDArray) -> NDArray[np.int64]:
    """Stamps of times [s]; time 0 is stamped 1 s."""
    return np.round((np.asarray(t) + 1.0) * 1e9).astype(np.int64)


def sines(
    amplitudes: NDArray, frequencies_hz: NDArray, phases: NDArray, offset: NDArray | float = 0.0
) -> Path:
    """A sum of sines per axis from (K, 3) arrays."""

    def path(t: NDArray) -> NDArray:
        angles = 2 * np.pi * np.asarray(t)[:, None, None] * frequencies_hz + phases
        return (amplitudes * np.sin(angles)).sum(axis=1) + offset

    return path


def lively(rng: np.random.Generator, sway_m: float = 0.3, turn_rad: float = 0.25) -> Motion:
    """A random smooth motion with everything in it, 0.1 to 0.8 Hz."""

    def draw(size: float, high: float) -> Path:
        frequencies = rng.uniform(0.1, high, (3, 3))
        return sines(size * rng.normal(size=(3, 3)), frequencies, rng.uniform(0, 2 * np.pi, (3, 3)))

    return Motion(draw(sway_m, 0.5), draw(turn_rad, 0.8))

"""Simulated visual keyframes with inertial motions between them, in a frame of any attitude."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from airground.core.se3 import SE3
from airground.slam.inertial.alignment import VisualNoise
from airground.slam.inertial.preintegration import ImuBuffer, Preintegration
from tests.slam.inertial_motion import (
    ADIS16448,
    BIAS_SIGMAS,
    Motion,
    Reading,
    read_imu,
    sines,
    to_ns,
)

T_RIG_CAMERA = SE3.from_rotation_vector((3.08, 0.02, 0.05), (0.05, -0.02, -0.03))
POSITION_SIGMA = 1e-3
ROTATION_SIGMA = 1e-3
UNIT_M = 2.5
NOISE = VisualNoise(POSITION_SIGMA / UNIT_M, ROTATION_SIGMA)


@dataclass(frozen=True, eq=False)
class Keyframes:
    """Visual poses in a frame v of any attitude and unit, and the truth."""

    times: NDArray
    rotations: NDArray
    centres: NDArray
    motions: list[Preintegration]
    R_v_world: NDArray
    reading: Reading


def keyframes_of(
    motion: Motion,
    seconds: float,
    rng: np.random.Generator,
    noisy: bool = True,
    every_s: float = 0.25,
    bias_sigmas: tuple[float, float] = BIAS_SIGMAS,
) -> Keyframes:
    sigmas = bias_sigmas if noisy else (0.0, 0.0)
    reading = read_imu(motion, seconds + 0.1, rng if noisy else None, bias_sigmas=sigmas)
    buffer = ImuBuffer(ADIS16448)
    buffer.add(reading.samples)
    times = np.arange(0, seconds + 1e-9, every_s)
    stamps = to_ns(times)
    motions = [
        buffer.preintegrate(int(a), int(b), np.zeros(3), np.zeros(3)) for a, b in pairwise(stamps)
    ]
    rotations = motion.rotations(times)
    centres = motion.position(times) + rotations @ T_RIG_CAMERA.translation
    if noisy:
        turns = Rotation.from_rotvec(rng.normal(0, ROTATION_SIGMA, (len(times), 3)))
        rotations = rotations @ turns.as_matrix()
        centres = centres + rng.normal(0, POSITION_SIGMA, centres.shape)
    v = Rotation.from_rotvec(rng.normal(0, 1.5, 3)).as_matrix()
    shifted = (centres - centres[0]) @ v.T / UNIT_M
    return Keyframes(times, v @ rotations, shifted, motions, v, reading)


def tilting(rng: np.random.Generator, size_rad: float = 0.03):
    shape = (2, 3)
    return sines(
        size_rad * rng.normal(size=shape),
        rng.uniform(0.3, 1.2, shape),
        rng.uniform(0, 2 * np.pi, shape),
    )


def rising(t: NDArray) -> NDArray:
    """A take-off to 2.2 m in 3 s."""
    x = np.clip(np.asarray(t) / 3.0, 0, 1)
    height = 2.2 * (10 * x**3 - 15 * x**4 + 6 * x**5)
    return height[:, None] * np.array([0.05, 0.0, 1.0])


def swaying(rng: np.random.Generator):
    """A few centimetres at 0.3 Hz."""
    shape = (1, 3)
    return sines(np.full(shape, 0.05), np.full(shape, 0.3), rng.uniform(0, 2 * np.pi, shape))


def even(velocity: NDArray):
    return lambda t: np.asarray(t)[:, None] * velocity

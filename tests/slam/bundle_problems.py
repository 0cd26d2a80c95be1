"""A rig that flies over scattered points: problems of any size with known truth."""

from dataclasses import dataclass, replace

import numpy as np

from airground.core.camera import PinholeCamera
from airground.core.messages import ImuNoise, ImuSamples
from airground.core.se3 import SE3
from airground.slam import so3
from airground.slam.bundle_adjustment import InertialFactor, Observations, Role, States
from airground.slam.inertial.preintegration import GRAVITY_MAP, ImuBuffer

CAMERA = PinholeCamera(752, 480, 420.0, 415.0, 375.5, 239.5)
T_RIG_CAMERA = SE3.from_rotation_vector((3.0, 0.05, 0.02), (0.03, -0.02, -0.05))
NOISE = ImuNoise(1.7e-4, 1.9e-5, 2e-3, 3e-3)
GYRO_BIAS, ACCELEROMETER_BIAS = np.array([0.01, -0.005, 0.008]), np.array([0.05, -0.1, 0.08])
SIGMA_PX, SIGMA_INVERSE_DEPTH = 0.7, 0.003
START_S = 1.0


@dataclass(frozen=True)
class Problem:
    """The true states and points, and what was measured of them."""

    states: States
    points: np.ndarray
    observations: Observations
    inertial: list[InertialFactor]


def position(t: float) -> np.ndarray:
    return np.array([0.45 * t, 0.5 * np.sin(1.1 * t), 2.2 + 0.15 * np.sin(1.7 * t)])


def rotation(t: float) -> np.ndarray:
    return so3.exp(np.array([0.06 * np.sin(1.3 * t), 0.05 * np.cos(1.1 * t), 0.3 * np.sin(t)]))


def imu_samples(end_s: float, rate_hz: float, rng: np.random.Generator | None) -> ImuSamples:
    """What the IMU reads, free of noise without `rng`."""
    times = np.arange(0.9, end_s + 0.1, 1.0 / rate_hz)
    turns = [so3.log(rotation(t - 1e-4).T @ rotation(t + 1e-4)) / 2e-4 for t in times]
    pushes = [
        rotation(t).T
        @ ((position(t + 1e-3) - 2 * position(t) + position(t - 1e-3)) / 1e-6 - GRAVITY_MAP)
        for t in times
    ]
    gyro, accelerometer = np.array(turns) + GYRO_BIAS, np.array(pushes) + ACCELEROMETER_BIAS
    if rng is not None:
        share = np.sqrt(rate_hz)
        gyro += NOISE.gyro_noise_density * share * rng.standard_normal(gyro.shape)
        accelerometer += NOISE.accelerometer_noise_density * share * rng.standard_normal(gyro.shape)
    return ImuSamples(np.round(times * 1e9).astype(np.int64), gyro, accelerometer)


def make(
    keyframes: int,
    points: int,
    seen: int,
    *,
    seed: int = 0,
    interval_s: float = 0.4,
    noise: bool = True,
    depth: bool = False,
    inertial: bool = True,
    rate_hz: float = 400.0,
) -> Problem:
    """A flight over `points` points, at most `seen` of them in a keyframe."""
    rng = np.random.default_rng(seed)
    times = START_S + interval_s * np.arange(keyframes)
    states = States(
        np.array([rotation(t) for t in times]),
        np.array([position(t) for t in times]),
        np.array([(position(t + 1e-5) - position(t - 1e-5)) / 2e-5 for t in times]),
        np.tile(GYRO_BIAS, (keyframes, 1)),
        np.tile(ACCELEROMETER_BIAS, (keyframes, 1)),
    )
    low, high = (-1.2, -1.5, 0.0), (states.positions[-1, 0] + 1.2, 1.5, 0.7)
    cloud = rng.uniform(low, high, (points, 3))
    observations = _observe(states, cloud, seen, noise, depth, rng)
    factors = []
    if inertial:
        buffer = ImuBuffer(NOISE)
        buffer.add(imu_samples(times[-1], rate_hz, rng if noise else None))
        stamps = [round(t * 1e9) for t in times]
        # Linearized beside the true biases, so that the first-order correction has work.
        biases = 0.9 * GYRO_BIAS, 0.9 * ACCELEROMETER_BIAS
        factors = [
            InertialFactor(k, k + 1, buffer.preintegrate(stamps[k], stamps[k + 1], *biases))
            for k in range(keyframes - 1)
        ]
    return Problem(states, cloud, observations, factors)


def _observe(states, cloud, seen, noise, depth, rng) -> Observations:
    rows = []
    for k in range(len(states)):
        pose = SE3(states.rotations[k], states.positions[k]) @ T_RIG_CAMERA
        in_camera = pose.inverse() @ cloud
        pixels = CAMERA.project(in_camera)
        inside = ((pixels > 0) & (pixels < (CAMERA.width - 1, CAMERA.height - 1))).all(axis=1)
        visible = np.flatnonzero(inside)
        visible = rng.permutation(visible)[:seen]
        for j in visible:
            rows.append((k, j, *pixels[j], 1.0 / in_camera[j, 2] if depth else np.nan))
    table = np.array(rows)
    count = len(table)
    pixels = table[:, 2:4] + noise * SIGMA_PX * rng.standard_normal((count, 2))
    inverse = table[:, 4] + noise * SIGMA_INVERSE_DEPTH * rng.standard_normal(count)
    if depth:
        inverse[rng.random(count) < 0.3] = np.nan
    return Observations(
        table[:, 0].astype(np.int64),
        table[:, 1].astype(np.int64),
        pixels,
        np.full(count, SIGMA_PX),
        inverse,
        np.full(count, SIGMA_INVERSE_DEPTH),
    )


def fixed(states: States, count: int) -> np.ndarray:
    """Roles with the first `count` keyframes fixed."""
    roles = np.full(len(states), int(Role.FREE))
    roles[:count] = Role.FIXED
    return roles


def perturbed(problem: Problem, roles: np.ndarray, *, seed: int = 7, share: float = 1.0):
    """States and points beside the truth: 0.6 deg, 2 cm, 3 cm/s, points 5 cm."""
    rng = np.random.default_rng(seed)
    true = problem.states
    moves = share * (roles != Role.FIXED)[:, None]
    shape = (len(true), 3)

    def off(sigma: float) -> np.ndarray:
        return moves * sigma * rng.standard_normal(shape)

    states = replace(
        true,
        rotations=np.array(
            [r @ so3.exp(d) for r, d in zip(true.rotations, off(0.01), strict=True)]
        ),
        positions=true.positions + off(0.02),
        velocities=true.velocities + off(0.03),
        gyro_biases=true.gyro_biases + off(0.002),
        accelerometer_biases=true.accelerometer_biases + off(0.02),
    )
    return states, problem.points + share * 0.05 * rng.standard_normal(problem.points.shape)

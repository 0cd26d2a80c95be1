"""Faults of the inertial sensor and of the magnetometer beside it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from airground.core.messages import ImuSamples, MagneticSamples
from sim.sensors.sensor_errors import ImuNoise, MagneticNoise


def measure_imu(ideal: ImuSamples, noise: ImuNoise | None, rng: np.random.Generator) -> ImuSamples:
    """What the inertial sensor would say.

    Args:
        ideal: Readings of a perfect sensor, at equal steps of time.
        noise: Size of the faults; None leaves the sensor perfect.
        rng: Source of randomness.
    """
    if noise is None:
        return ideal
    step_s = float(np.median(np.diff(ideal.stamps_ns))) * 1e-9
    gyro, accelerometer = (
        faults(len(ideal.stamps_ns), step_s, density, walk, bias, rng)
        for density, walk, bias in (
            (noise.gyro_density, noise.gyro_walk, noise.gyro_bias),
            (noise.accelerometer_density, noise.accelerometer_walk, noise.accelerometer_bias),
        )
    )
    return ImuSamples(ideal.stamps_ns, ideal.gyro + gyro, ideal.accelerometer + accelerometer)


def faults(
    count: int,
    step_s: float,
    density: float,
    walk: float,
    start_bias: float,
    rng: np.random.Generator,
) -> NDArray[np.float64]:
    """(count, 3) what is added to perfect samples.

    A white noise of `density` [x/sqrt(Hz)] has the deviation density / sqrt(step) a sample;
    a bias of `walk` [x/s/sqrt(Hz)] changes by walk * sqrt(step) from sample to sample.
    """
    white = rng.normal(0.0, density / np.sqrt(step_s), (count, 3))
    steps = rng.normal(0.0, walk * np.sqrt(step_s), (count, 3))
    steps[0] = rng.normal(0.0, start_bias, 3)
    return white + np.cumsum(steps, axis=0)


def measure_field(
    stamps_ns: NDArray[np.int64],
    field_imu: NDArray[np.float64],
    anomaly_imu: NDArray[np.float64],
    noise: MagneticNoise | None,
    rng: np.random.Generator,
) -> MagneticSamples:
    """What the magnetometer would say, with the robot's own iron and the building's.

    Args:
        stamps_ns: (N,) stamps of the samples [ns].
        field_imu: (N, 3) true field at the sensor, in its frame [T].
        anomaly_imu: (N, 3) the part of it that the building adds [T].
        noise: Size of the faults; None gives the Earth's field alone.
        rng: Source of randomness.
    """
    earth = field_imu - anomaly_imu
    if noise is None:
        return MagneticSamples(stamps_ns, earth)
    hard_iron = rng.normal(0.0, noise.hard_iron_t, 3)
    white = rng.normal(0.0, noise.noise_t, earth.shape)
    return MagneticSamples(stamps_ns, earth + noise.anomaly_scale * anomaly_imu + hard_iron + white)

"""An inertial sensor's faults: white noise, a bias at the start, and its random walk."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from airground.core.messages import ImuSamples
from sim.sensors.presets import ImuNoise


def measure_imu(ideal: ImuSamples, noise: ImuNoise | None, rng: np.random.Generator) -> ImuSamples:
    """What the sensor would say.

    Args:
        ideal: Readings of a perfect sensor, at equal steps of time.
        noise: Size of the faults; None leaves the sensor perfect.
        rng: Source of randomness.
    """
    if noise is None:
        return ideal
    step_s = float(np.median(np.diff(ideal.stamps_ns))) * 1e-9
    gyro = faults(
        len(ideal.stamps_ns), step_s, noise.gyro_density, noise.gyro_walk, noise.gyro_bias, rng
    )
    accelerometer = faults(
        len(ideal.stamps_ns),
        step_s,
        noise.accelerometer_density,
        noise.accelerometer_walk,
        noise.accelerometer_bias,
        rng,
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

"""A magnetometer's faults: noise, what is left of the robot's own iron, and the building's."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from airground.core.messages import MagneticSamples
from sim.sensors.presets import MagneticNoise


def measure_field(
    stamps_ns: NDArray[np.int64],
    field_imu: NDArray[np.float64],
    anomaly_imu: NDArray[np.float64],
    noise: MagneticNoise | None,
    rng: np.random.Generator,
) -> MagneticSamples:
    """What the sensor would say.

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

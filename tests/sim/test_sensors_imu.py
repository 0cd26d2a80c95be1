"""Noise densities and bias walks are what the data sheet says; so is the compass."""

import numpy as np
import pytest

from airground.core.messages import ImuSamples
from sim.sensors.imu import faults, measure_field, measure_imu
from sim.sensors.presets import HARSH, NOMINAL

RATE_HZ = 200.0


def ideal(count: int) -> ImuSamples:
    stamps = np.arange(count, dtype=np.int64) * 5_000_000
    return ImuSamples(stamps, np.ones((count, 3)), np.full((count, 3), 9.81))


def allan_deviation(samples: np.ndarray, group: int) -> np.ndarray:
    """Of averages over `group` samples, per axis."""
    means = samples[: len(samples) // group * group].reshape(-1, group, 3).mean(axis=1)
    return np.sqrt(0.5 * np.mean(np.diff(means, axis=0) ** 2, axis=0))


def test_allan_deviation_of_white_noise() -> None:
    """Falls as density / sqrt(time); at one second it is the density."""
    density = 1.7e-4
    samples = faults(400_000, 1 / RATE_HZ, density, 0.0, 0.0, np.random.default_rng(0))
    for seconds in (0.1, 1.0, 10.0):
        measured = allan_deviation(samples, round(seconds * RATE_HZ)).mean()
        assert measured == pytest.approx(density / np.sqrt(seconds), rel=0.15)


def test_allan_deviation_of_the_bias_walk() -> None:
    """Rises as walk * sqrt(time / 3)."""
    walk = 2e-5
    samples = faults(400_000, 1 / RATE_HZ, 0.0, walk, 0.0, np.random.default_rng(1))
    for seconds in (1.0, 10.0):
        measured = allan_deviation(samples, round(seconds * RATE_HZ)).mean()
        assert measured == pytest.approx(walk * np.sqrt(seconds / 3), rel=0.3)


def test_bias_at_the_start() -> None:
    biases = [faults(2, 5e-3, 0.0, 0.0, 0.05, np.random.default_rng(s))[0] for s in range(400)]
    assert np.std(biases) == pytest.approx(0.05, rel=0.1)


def test_a_perfect_imu_is_the_ideal_one() -> None:
    samples = ideal(10)
    assert measure_imu(samples, None, np.random.default_rng(0)) is samples


def test_harsh_is_three_times_nominal() -> None:
    one, three = (
        measure_imu(ideal(100), preset.imu, np.random.default_rng(3)) for preset in (NOMINAL, HARSH)
    )
    np.testing.assert_allclose(three.gyro - 1, 3 * (one.gyro - 1))
    np.testing.assert_allclose(three.accelerometer - 9.81, 3 * (one.accelerometer - 9.81))


EARTH = np.array([21.5e-6, 0.0, -43.0e-6])
ANOMALY_T = 0.8e-6 / np.sqrt(2)  # per horizontal axis, as sim.world.magnetic_field makes it


def heading_errors(preset, trials: int = 300) -> np.ndarray:
    """Degrees by which the mean field over a second at one place is off."""
    errors = []
    for seed in range(trials):
        rng = np.random.default_rng(seed)
        anomaly = np.tile(rng.normal(0, ANOMALY_T, 3), (50, 1))
        stamps = np.arange(50) * 20_000_000
        samples = measure_field(stamps, EARTH + anomaly, anomaly, preset.magnetic, rng)
        mean = samples.field.mean(axis=0)
        errors.append(np.rad2deg(np.arctan2(mean[1], mean[0])))
    return np.array(errors)


def test_heading_errors_of_the_presets() -> None:
    """1 to 2 degrees nominal, 3 to 5 harsh (one deviation)."""
    assert 0.8 < heading_errors(NOMINAL).std() < 2.0
    assert 3.0 < heading_errors(HARSH).std() < 5.0


def test_a_perfect_magnetometer_feels_the_earth_alone() -> None:
    anomaly = np.full((4, 3), 1e-6)
    samples = measure_field(np.arange(4), EARTH + anomaly, anomaly, None, np.random.default_rng(0))
    np.testing.assert_allclose(samples.field, np.tile(EARTH, (4, 1)), atol=1e-15)

"""Two inertial motions joined against one summed up from the samples."""

import numpy as np
import pytest

from airground.slam.inertial.joining import join
from airground.slam.inertial.preintegration import ImuBuffer, Preintegration
from tests.slam.inertial_motion import ADIS16448, lively, read_imu, to_ns

JACOBIANS = [
    "rotation_by_gyro_bias",
    "velocity_by_gyro_bias",
    "velocity_by_accelerometer_bias",
    "position_by_gyro_bias",
    "position_by_accelerometer_bias",
]


def motions(
    seed: int, middle_s: float, shift: float
) -> tuple[Preintegration, Preintegration, Preintegration]:
    """Up to the middle, from there on with biases that differ by `shift`, and all at once."""
    rng = np.random.default_rng(seed)
    buffer = ImuBuffer(ADIS16448)
    buffer.add(read_imu(lively(rng), 3.0, rng).samples)
    start, middle, end = (int(s) for s in to_ns(np.array([0.2, middle_s, 2.5])))
    gyro, force = rng.normal(0, [[0.02], [0.1]], (2, 3))
    off = shift * rng.normal(0, [[0.002], [0.02]], (2, 3))
    return (
        buffer.preintegrate(start, middle, gyro, force),
        buffer.preintegrate(middle, end, gyro + off[0], force + off[1]),
        buffer.preintegrate(start, end, gyro, force),
    )


@pytest.mark.parametrize("middle_s", [0.4, 1.35, 2.4])
@pytest.mark.parametrize("seed", range(3))
def test_the_joined_motion_is_the_whole_one(seed: int, middle_s: float) -> None:
    first, second, whole = motions(seed, middle_s, shift=0.0)
    joined = join(first, second)
    assert joined.duration_s == pytest.approx(whole.duration_s)
    for name in ("rotation", "velocity", "position"):
        # Readings at the middle are interpolated, which the whole motion steps across.
        np.testing.assert_allclose(getattr(joined, name), getattr(whole, name), atol=3e-5)
    for name in JACOBIANS:
        np.testing.assert_allclose(getattr(joined, name), getattr(whole, name), atol=1e-3)
    sigmas = np.sqrt(np.diag(whole.covariance))
    off = (joined.covariance - whole.covariance) / np.outer(sigmas, sigmas)
    assert np.abs(off).max() < 0.02
    assert joined.gyro_bias_sigma == pytest.approx(whole.gyro_bias_sigma)
    assert joined.accelerometer_bias_sigma == pytest.approx(whole.accelerometer_bias_sigma)


@pytest.mark.parametrize("seed", range(3))
def test_other_biases_of_the_second_count_to_first_order(seed: int) -> None:
    first, second, whole = motions(seed, 1.35, shift=1.0)
    joined = join(first, second)
    moved = np.linalg.norm(second.corrected(*np.zeros((2, 3)))[2] - second.position)
    assert moved > 1e-2  # uncorrected, the biases would be seen
    for name in ("rotation", "velocity", "position"):
        np.testing.assert_allclose(getattr(joined, name), getattr(whole, name), atol=1e-4)
    assert joined.gyro_bias is first.gyro_bias


def test_joining_is_associative_and_keeps_the_longest_gap() -> None:
    rng = np.random.default_rng(0)
    buffer = ImuBuffer(ADIS16448)
    buffer.add(read_imu(lively(rng), 3.0, rng).samples)
    stamps = [int(s) for s in to_ns(np.array([0.2, 0.9, 1.4, 2.6]))]
    biases = rng.normal(0, 0.02, (2, 3))
    a, b, c = (buffer.preintegrate(stamps[n], stamps[n + 1], *biases) for n in range(3))
    left, right = join(join(a, b), c), join(a, join(b, c))
    for name in ["rotation", "velocity", "position", "covariance", *JACOBIANS]:
        np.testing.assert_allclose(getattr(left, name), getattr(right, name), atol=1e-12)
    assert left.longest_gap_s == max(m.longest_gap_s for m in (a, b, c))

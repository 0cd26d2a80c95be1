"""Rest is distinguished from hovering and driving, and gives gravity and the gyro's bias."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from airground.core.messages import ImuSamples
from airground.slam.inertial.stationarity import at_rest, gravity_aligned
from tests.slam.inertial_motion import ADIS16448, Motion, lively, read_imu, sines


def still(t):
    return np.zeros((len(t), 3))


def leaning(t):
    return np.tile([0.1, -0.2, 0.7], (len(t), 1))


def last_second(motion: Motion, rng: np.random.Generator) -> ImuSamples:
    return read_imu(motion, 1.0, rng).samples


@pytest.mark.parametrize("seed", range(10))
def test_rest_gives_bias_and_gravity(seed):
    rng = np.random.default_rng(seed)
    reading = read_imu(Motion(still, leaning), 1.0, rng)
    rest = at_rest(reading.samples, ADIS16448)
    assert rest is not None
    np.testing.assert_allclose(rest.gyro, reading.gyro_biases[-1], atol=1e-3)
    R_world_imu = Motion(still, leaning).rotations(np.zeros(1))[0]
    up = gravity_aligned(rest.specific_force, np.array([1.0, 0, 0]))[2]
    # The accelerometer's bias of 0.05 m/s^2 tilts by 5 mrad.
    assert np.arccos(up @ R_world_imu[2]) < 0.02


@pytest.mark.parametrize("seed", range(10))
def test_motion_is_no_rest(seed):
    rng = np.random.default_rng(seed)
    assert at_rest(last_second(lively(rng), rng), ADIS16448) is None
    hover = sines(np.full((1, 3), 0.02), np.full((1, 3), 0.7), rng.uniform(0, 6.28, (1, 3)))
    rocking = sines(np.full((1, 3), 0.02), np.full((1, 3), 1.0), rng.uniform(0, 6.28, (1, 3)))
    assert at_rest(last_second(Motion(hover, rocking), rng), ADIS16448) is None


def test_even_turning_and_free_fall_are_no_rest():
    stamps = np.arange(200, dtype=np.int64) * 5_000_000
    up, zero = np.tile([0, 0, 9.81], (200, 1)), np.zeros((200, 3))
    assert at_rest(ImuSamples(stamps, zero, up), ADIS16448) is not None
    assert at_rest(ImuSamples(stamps, zero + 0.2, up), ADIS16448) is None
    assert at_rest(ImuSamples(stamps, zero, zero), ADIS16448) is None
    assert at_rest(ImuSamples(stamps[:5], zero[:5], up[:5]), ADIS16448) is None


VECTORS = st.tuples(*[st.floats(-10, 10)] * 3).filter(lambda v: np.linalg.norm(v) > 0.1)


@settings(deadline=None)
@given(VECTORS, VECTORS)
def test_gravity_aligned_is_upright_and_heads_along_the_hint(up, hint):
    up, hint = np.array(up), np.array(hint)
    sine = np.linalg.norm(np.cross(up, hint)) / np.linalg.norm(up) / np.linalg.norm(hint)
    if sine < 1e-3:
        return
    R = gravity_aligned(up, hint)
    np.testing.assert_allclose(R @ R.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(R) == pytest.approx(1)
    np.testing.assert_allclose(R @ up, (0, 0, np.linalg.norm(up)), atol=1e-9)
    turned = R @ hint
    assert turned[0] > 0
    assert turned[1] == pytest.approx(0, abs=1e-9)


def test_a_vertical_hint_is_refused():
    with pytest.raises(ValueError, match="must not be vertical"):
        gravity_aligned(np.array([0, 0, 9.81]), np.array([0, 0, 1.0]))

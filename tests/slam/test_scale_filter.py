"""The filter settles on the scale where motion shows it, from any guess, and says how well."""

import numpy as np
import pytest

from airground.slam import so3
from airground.slam.inertial.alignment import VisualNoise
from airground.slam.inertial.scale_filter import ScaleFilter
from tests.slam.inertial_keyframes import (
    NOISE,
    T_RIG_CAMERA,
    UNIT_M,
    Keyframes,
    even,
    keyframes_of,
    rising,
    swaying,
    tilting,
)
from tests.slam.inertial_motion import Motion, lively

RATE_HZ = 30


def filtered(images: Keyframes, guess: float = 1.0, lost: range = range(0)) -> ScaleFilter:
    scale_filter = ScaleFilter(T_RIG_CAMERA, guess)
    for k in range(len(images.rotations)):
        if k in lost:
            continue
        motion = images.motions[k - 1] if k > 0 and k - 1 not in lost else None
        scale_filter.add(images.rotations[k], images.centres[k], NOISE, motion)
    return scale_filter


def images_of(position, rng: np.random.Generator, seconds: float, tilt_rad: float = 0.03):
    motion = Motion(position, tilting(rng, tilt_rad))
    return keyframes_of(motion, seconds, rng, every_s=1 / RATE_HZ)


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("path", ["lively", "take-off", "sway"])
@pytest.mark.parametrize("guess", [1.0, 8.0])
def test_settles_within_two_percent_in_seconds(seed, path, guess):
    rng = np.random.default_rng(seed)
    position = {
        "lively": lively(rng, sway_m=0.1).position,
        "take-off": rising,
        "sway": swaying(rng),
    }[path]
    images = images_of(position, rng, 6.0)
    result = filtered(images, guess)
    assert result.observable
    assert result.scale == pytest.approx(UNIT_M, rel=0.03 if path == "sway" else 0.02)
    down = images.R_v_world.T @ result.gravity
    assert np.hypot(down[0], down[1]) / 9.81 < 0.03
    truth = images.reading.accelerometer_biases[-1]
    np.testing.assert_allclose(result.accelerometer_bias, truth, atol=0.2)


def test_errors_are_as_large_as_the_filter_says():
    squares = []
    for seed in range(24):
        rng = np.random.default_rng(100 + seed)
        result = filtered(images_of((rising, swaying(rng))[seed % 2], rng, 5.0))
        squares.append((np.log(result.scale / UNIT_M) / result.sigma) ** 2)
    # It is cautious by design (the scale may drift), never bold.
    assert 0.05 < np.mean(squares) < 1.5


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("velocity", [(0, 0, 0), (0.5, 0, 0)])
@pytest.mark.parametrize("tilt_rad", [0.0, 0.01])
def test_hover_and_even_motion_do_not_show_the_scale(seed, velocity, tilt_rad):
    rng = np.random.default_rng(seed)
    result = filtered(images_of(even(np.array(velocity, float)), rng, 8.0, tilt_rad))
    assert not result.observable


def test_goes_on_after_images_were_lost():
    rng = np.random.default_rng(5)
    images = images_of(lively(rng).position, rng, 8.0)
    result = filtered(images, lost=range(100, 130))
    assert result.scale == pytest.approx(UNIT_M, rel=0.02)


def test_follows_a_map_that_is_scaled_turned_and_shifted():
    rng = np.random.default_rng(5)
    images = images_of(lively(rng).position, rng, 6.0)
    stays, follows = ScaleFilter(T_RIG_CAMERA), ScaleFilter(T_RIG_CAMERA)
    factor, shift = 3.0, np.array([1.0, -2.0, 0.5])
    turn = so3.exp(np.array([0.4, -1.0, 0.2]))
    moved = False
    for k in range(len(images.rotations)):
        motion = images.motions[k - 1] if k > 0 else None
        R, centre = images.rotations[k], images.centres[k]
        if k == 90:
            follows.follow(factor, turn, np.zeros(3), shift)
            moved = True
        stays.add(R, centre, NOISE, motion)
        if moved:
            noise = VisualNoise(factor * NOISE.position_sigma, NOISE.rotation_sigma)
            follows.add(turn @ R, factor * turn @ centre + shift, noise, motion)
        else:
            follows.add(R, centre, NOISE, motion)
    assert follows.scale == pytest.approx(stays.scale / factor, rel=1e-6)
    assert follows.sigma == pytest.approx(stays.sigma, rel=1e-6)
    np.testing.assert_allclose(follows.gravity, turn @ stays.gravity, rtol=1e-6)
    np.testing.assert_allclose(
        follows.accelerometer_bias, stays.accelerometer_bias, rtol=1e-4, atol=1e-6
    )


def test_a_rising_camera_is_measured_ever_more_coarsely():
    """The noise is each image's own: over a rise, that of the first one would be far too small."""
    rng = np.random.default_rng(3)
    images = images_of(rising, rng, 6.0)
    honest, misled = ScaleFilter(T_RIG_CAMERA), ScaleFilter(T_RIG_CAMERA)
    for k, (R, centre) in enumerate(zip(images.rotations, images.centres, strict=True)):
        coarse = VisualNoise(NOISE.position_sigma * (1.0 + 0.1 * k), NOISE.rotation_sigma)
        seen = centre + rng.normal(0.0, coarse.position_sigma, 3)
        motion = images.motions[k - 1] if k > 0 else None
        honest.add(R, seen, coarse, motion)
        misled.add(R, seen, NOISE, motion)
    assert abs(np.log(honest.scale / UNIT_M)) < 3.0 * honest.sigma
    assert abs(honest.scale - UNIT_M) < abs(misled.scale - UNIT_M)


def test_knows_nothing_before_the_first_motion():
    rng = np.random.default_rng(5)
    images = images_of(lively(rng).position, rng, 1.0)
    result = ScaleFilter(T_RIG_CAMERA)
    result.add(images.rotations[0], images.centres[0], NOISE, None)
    assert np.isnan(result.scale)
    assert np.isinf(result.sigma)
    assert not result.observable
    assert result.gravity is None

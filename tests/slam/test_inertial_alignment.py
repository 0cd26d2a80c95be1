"""Scale, gravity, velocities and biases of simulated keyframes, and honesty where none show."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import chi2

from airground.core.se3 import SE3
from airground.slam import so3
from airground.slam.inertial.alignment import InertialAlignment, VisualNoise, align, refine_scale
from airground.slam.inertial.preintegration import GRAVITY
from tests.slam.inertial_keyframes import (
    NOISE,
    POSITION_SIGMA,
    ROTATION_SIGMA,
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


def aligned(keyframes: Keyframes) -> InertialAlignment:
    k = keyframes
    return align(k.rotations, k.centres, T_RIG_CAMERA, k.motions, NOISE)


@pytest.mark.parametrize("seed", range(5))
def test_exact_keyframes_are_aligned_exactly(seed):
    rng = np.random.default_rng(seed)
    motion = lively(rng)
    keyframes = keyframes_of(motion, 4.0, rng, noisy=False)
    result = aligned(keyframes)
    assert result.observable
    # What is left is the midpoint rule's, at 200 Hz.
    assert result.scale == pytest.approx(UNIT_M, rel=1e-3)
    R_map_world = result.R_map_v @ keyframes.R_v_world
    np.testing.assert_allclose(R_map_world[2], (0, 0, 1), atol=1e-4)
    expected = motion.velocities(keyframes.times) @ R_map_world.T
    np.testing.assert_allclose(result.velocities, expected, atol=2e-3)
    np.testing.assert_allclose(result.gyro_biases[-1], 0, atol=1e-4)
    right = result.R_map_v @ keyframes.rotations[0] @ T_RIG_CAMERA.rotation[:, 0]
    assert right[0] > 0
    assert right[1] == pytest.approx(0, abs=1e-9)


def test_scale_is_consistent_over_100_motions():
    """Normalized errors of scale as chi-square wants them, with a sensor as in EuRoC."""
    squares, off = [], []
    for seed in range(100):
        rng = np.random.default_rng(1000 + seed)
        path = (lively(rng, sway_m=0.1).position, rising, swaying(rng))[seed % 3]
        result = aligned(keyframes_of(Motion(path, tilting(rng)), 4.0, rng))
        error = np.log(result.scale / UNIT_M)
        squares.append((error / result.scale_sigma) ** 2)
        off.append(abs(error))
        assert result.observable
    low, high = chi2.ppf([0.005, 0.995], 100)
    assert low < sum(squares) < high
    assert np.median(off) < 0.01


@pytest.mark.parametrize("path", ["sway", "take-off"])
def test_a_sway_or_a_take_off_shows_the_scale_within_seconds(path):
    rng = np.random.default_rng(3)
    position = swaying(rng) if path == "sway" else rising
    keyframes = keyframes_of(Motion(position, tilting(rng)), 4.0, rng)
    result = aligned(keyframes)
    assert result.observable
    assert result.scale == pytest.approx(UNIT_M, rel=0.05)
    up = result.R_map_v @ keyframes.R_v_world[:, 2]
    assert np.hypot(up[0], up[1]) < 4 * result.tilt_sigma
    at_end = round(keyframes.times[-1] * 200)
    truth = keyframes.reading.gyro_biases[at_end]
    np.testing.assert_allclose(result.gyro_biases[-1], truth, atol=2e-3)


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("velocity", [(0, 0, 0), (0.5, 0, 0), (0.3, -0.2, 0.1)])
@pytest.mark.parametrize("tilt_rad", [0.0, 0.03])
@pytest.mark.parametrize("seconds", [3.0, 10.0])
def test_hover_and_even_motion_do_not_show_the_scale(seed, velocity, tilt_rad, seconds):
    rng = np.random.default_rng(seed)
    motion = Motion(even(np.array(velocity, float)), tilting(rng, tilt_rad))
    result = aligned(keyframes_of(motion, seconds, rng))
    assert not result.observable
    assert result.scale_sigma > 0.05


def squared_tilts(bias_mps2: float, stated_mps2: float) -> float:
    """Of 60 take-offs, normalized by the alignment's own deviation per axis and summed."""
    total = 0.0
    for seed in range(2000, 2060):
        rng = np.random.default_rng(seed)
        motion = Motion(rising, tilting(rng))
        k = keyframes_of(motion, 4.0, rng, bias_sigmas=(5e-3, bias_mps2))
        result = align(k.rotations, k.centres, T_RIG_CAMERA, k.motions, NOISE, stated_mps2)
        up = result.R_map_v @ k.R_v_world[:, 2]
        total += (up[0] ** 2 + up[1] ** 2) / result.tilt_sigma**2
    return total


@pytest.mark.parametrize("bias_mps2", [0.1, 0.2])
def test_the_vertical_is_as_uncertain_as_the_bias_of_the_accelerometer(bias_mps2):
    low, high = chi2.ppf([0.005, 0.995], 120)
    assert low < squared_tilts(bias_mps2, bias_mps2) < high


def test_a_bias_above_the_stated_one_shows_in_the_tilts():
    assert squared_tilts(bias_mps2=0.2, stated_mps2=0.1) > 200


def test_true_noise_above_the_stated_widens_the_sigma():
    rng = np.random.default_rng(2)
    k = keyframes_of(Motion(rising, tilting(rng)), 5.0, rng)
    results = [
        align(k.rotations, k.centres, T_RIG_CAMERA, k.motions, VisualNoise(share * 1e-3, 1e-3))
        for share in (0.1, 0.4)
    ]
    assert results[0].rms > 1.5
    assert results[0].scale_sigma > 0.5 * results[1].scale_sigma


def test_too_few_keyframes_or_motions_are_refused():
    rng = np.random.default_rng(0)
    k = keyframes_of(lively(rng), 1.0, rng)
    with pytest.raises(ValueError, match="needs 4 keyframes, got 3"):
        align(k.rotations[:3], k.centres[:3], T_RIG_CAMERA, k.motions[:2], NOISE)
    with pytest.raises(ValueError, match="go with as many centres and 4 motions"):
        align(k.rotations, k.centres, T_RIG_CAMERA, k.motions[:3], NOISE)


def test_refinement_knows_the_vertical_as_well_as_the_stated_accelerometer_shows_it():
    rng = np.random.default_rng(7)
    # Without turning, the vertical and the accelerometer's bias cannot be separated.
    k = keyframes_of(Motion(rising, tilting(rng, 0.0)), 4.0, rng)
    rotations = k.R_v_world.T @ k.rotations
    centres = UNIT_M * k.centres @ k.R_v_world
    noise = VisualNoise(POSITION_SIGMA, ROTATION_SIGMA)
    for stated in (0.1, 0.2):
        result = refine_scale(rotations, centres, T_RIG_CAMERA, k.motions, noise, stated)
        widened = max(1.0, result.rms)
        assert result.tilt_sigma == pytest.approx(widened * stated / GRAVITY, rel=0.03)


@pytest.mark.parametrize("holes", [False, True])
def test_refinement_finds_what_is_wrong_with_a_metric_map(holes):
    rng = np.random.default_rng(7)
    k = keyframes_of(lively(rng), 40.0, rng)
    tilt = SE3.from_rotation_vector((0.01, -0.02, 0.0)).rotation
    rotations = tilt @ k.R_v_world.T @ k.rotations
    centres = 1.03 * UNIT_M * k.centres @ k.R_v_world @ tilt.T
    motions = [None if holes and i in (20, 21, 90) else m for i, m in enumerate(k.motions)]
    noise = VisualNoise(POSITION_SIGMA, ROTATION_SIGMA)
    result = refine_scale(rotations, centres, T_RIG_CAMERA, motions, noise)
    assert result.observable
    error = np.log(result.scale * 1.03)
    assert abs(error) < 3 * result.scale_sigma < 0.01
    left = so3.log(result.R_map_v @ tilt)
    assert np.linalg.norm(left) < 1e-3
    assert abs(so3.log(result.R_map_v)[2]) < 1e-9

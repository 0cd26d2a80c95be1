"""Metric scale out of keyframes and the IMU between them, and how well it is said to be known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from airground.config import Config
from airground.slam import tight_scale
from airground.slam.front_end import Tracking
from airground.slam.inertial.alignment import OBSERVABLE_SIGMA, InertialAlignment
from airground.slam.inertial.preintegration import GRAVITY
from airground.slam.monocular import MonocularSlam
from airground.slam.tight_scale import TightScale
from tests.slam.driven_slam import DrivenSlam
from tests.slam.inertial_keyframes import even, rising, tilting
from tests.slam.inertial_motion import ADIS16448, Motion, lively
from tests.slam.synthetic_world import START_NS, Sequence, mav_sequence


def settle(driven: DrivenSlam) -> tuple[TightScale, int | None]:
    """The scale as far as it becomes known, and at which image that was."""
    scale = TightScale(driven.slam)
    for index in range(len(driven.times)):
        driven.image(index)
        moved = scale.update(True)
        assert moved == scale.known
        if moved:
            return scale, index
    return scale, None


@pytest.mark.parametrize("seed", range(3))
def test_scale_is_right_within_what_it_says(seed: int) -> None:
    driven = DrivenSlam(lively(np.random.default_rng(seed)), 12.0, seed)
    scale, index = settle(driven)
    assert index is not None
    assert scale.estimate is not None
    assert scale.estimate.observable
    assert scale.estimate.sigma < OBSERVABLE_SIGMA
    assert abs(driven.scale_error()) < 3.5 * scale.estimate.sigma
    assert driven.tilt() < np.deg2rad(1.0)
    assert driven.slam.metric
    assert driven.slam.inertial


def test_the_newest_state_is_the_true_one_and_knows_its_speed() -> None:
    motion = lively(np.random.default_rng(0))
    driven = DrivenSlam(motion, 12.0)
    _, index = settle(driven)
    assert index is not None
    t = driven.times[index : index + 1]
    speed = np.linalg.norm(driven.slam.state.velocity)
    assert speed == pytest.approx(np.linalg.norm(motion.velocities(t)[0]), rel=0.1, abs=0.02)


@pytest.mark.parametrize("name", ["still", "even"])
def test_without_acceleration_nothing_is_claimed(name: str) -> None:
    velocity = np.array([0.3, 0.1, 0.0]) if name == "even" else np.zeros(3)
    scale, index = settle(DrivenSlam(Motion(even(velocity), even(np.zeros(3))), 8.0))
    assert index is None
    assert scale.estimate is None or not scale.estimate.observable


def taking_off(stated_mps2: float) -> DrivenSlam:
    """A take-off with an accelerometer whose calibration states its bias to be so large."""
    imu = replace(ADIS16448, stated_bias_sigma=stated_mps2)
    return DrivenSlam(Motion(rising, tilting(np.random.default_rng(0))), 8.0, imu=imu)


@pytest.mark.parametrize("bias_mps2", [0.05, 0.15, 0.225])
def test_the_vertical_is_known_as_well_as_the_stated_accelerometer_shows_it(
    bias_mps2: float,
) -> None:
    scale, index = settle(taking_off(bias_mps2))
    assert index is not None
    assert scale.tilt_sigma == pytest.approx(bias_mps2 / GRAVITY, rel=0.15)


@pytest.mark.parametrize(
    ("stated_mps2", "tilt_sigma", "settles"),
    [
        (0.05, 0.008, True),
        (0.05, 0.009, False),
        (0.1, 0.012, True),
        (0.1, 0.014, False),
        (0.15, 0.014, True),
        (0.15, 0.020, False),
    ],
)
def test_a_vertical_settles_at_last_where_it_is_known_as_well_as_the_bias_lets_it(
    stated_mps2: float, tilt_sigma: float, settles: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    driven = taking_off(stated_mps2)
    scale, index = settle(driven)
    assert index is not None
    assert not scale.settled
    stated = []

    def refined(rotations, centres, T_rig_camera, motions, noise, bias_sigma):
        stated.append(bias_sigma)
        unmoved = np.zeros((len(rotations), 3))
        return InertialAlignment(
            1.0, np.eye(3), unmoved, unmoved, unmoved, 0.01, tilt_sigma, True, 1.0
        )

    monkeypatch.setattr(tight_scale, "refine_scale", refined)
    for later in range(index + 1, len(driven.times)):
        driven.image(later)
        scale.update(True)
    assert set(stated) == {stated_mps2}
    assert scale.settled == settles


def test_where_samples_are_missing_it_waits() -> None:
    driven = DrivenSlam(lively(np.random.default_rng(0)), 6.0)
    driven.samples_lost(0.3, 0.7)
    scale, index = settle(driven)
    assert index is None
    assert scale.estimate is None


def moving_start(sequence: Sequence, start_s: float) -> Sequence:
    """The same flight, switched on only after `start_s`."""
    start_ns = START_NS + round(start_s * 1e9)
    images = tuple(image for image in sequence.images if image.stamp_ns >= start_ns)
    imu = sequence.imu.between(start_ns - 20_000_000, 2**62)
    return replace(sequence, images=images, imu=imu)


@pytest.mark.parametrize(
    ("frames", "start_s"),
    [(96, 0.0), pytest.param(220, 1.0, marks=pytest.mark.slow)],
    ids=["from rest", "moving"],
)
def test_on_images_scale_is_right_within_what_it_says(frames: int, start_s: float) -> None:
    sequence = moving_start(mav_sequence(frames=frames, rate_hz=20.0), start_s)
    front_end = MonocularSlam(sequence.calibration, Config(), np.random.default_rng(0))
    tracked = sequence.feed(front_end)
    assert tracked[-1].tracking is Tracking.TRACKED
    assert tracked[-1].scale is not None
    path = front_end.trajectory()
    assert path is not None
    assert len(path) > 20
    true = np.array([sequence.T_world_camera.at(int(t)).translation for t in path.stamps_ns])
    spread = [np.linalg.norm(x - x.mean(axis=0)) for x in (path.translations, true)]
    first = next(pose for pose in tracked if pose.tracking is Tracking.TRACKED)
    assert first.scale is not None
    error = abs(spread[0] / spread[1] - 1.0)
    assert error < max(3.5 * tracked[-1].scale.sigma, 0.01)
    assert error < 0.02

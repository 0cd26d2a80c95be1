"""What the ground robot's SLAM does once it stood still: its accelerometer counts from then on."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from airground.config import Config
from airground.core.se3 import SE3, nearest_rotation
from airground.slam.front_end import TrackedPose
from airground.slam.rgbd import RgbdSlam
from tests.slam import hard_sequences as hard
from tests.slam.hard_sequences import Leg
from tests.slam.synthetic_world import Sequence

ACCELEROMETER_BIAS = np.array([0.12, -0.08, 0.05])
"""Of a cheap IMU: a robot at rest takes its vertical 0.8 deg wrong by it [m/s^2]."""
GYRO_BIAS = np.array([0.004, -0.006, 0.003])
ON = Leg(6.0, speed_mps=0.4, turn_deg_s=15.0, sway=1.0)


@cache
def driven(*legs: Leg) -> tuple[Sequence, RgbdSlam, list[TrackedPose]]:
    """A drive with a biased IMU, the SLAM that followed it, and what that said meanwhile."""
    sequence = hard.drive(*legs)
    imu = replace(
        sequence.imu,
        gyro=sequence.imu.gyro + GYRO_BIAS,
        accelerometer=sequence.imu.accelerometer + ACCELEROMETER_BIAS,
    )
    sequence = replace(sequence, imu=imu)
    slam = RgbdSlam(sequence.calibration, Config(), np.random.default_rng(0))
    return sequence, slam, sequence.feed(slam)


def tilt_deg(sequence: Sequence, poses: Iterable[SE3]) -> float:
    """Angle between the vertical of a map, by its first poses or all, and the world's."""
    pairs = zip(sequence.T_world_camera, poses, strict=False)
    turns = [truth.rotation @ pose.rotation.T for truth, pose in pairs]
    R_world_map = nearest_rotation(np.sum(turns, axis=0))
    return float(np.degrees(np.arccos(R_world_map[2, 2])))


stood = pytest.mark.parametrize(
    "legs",
    [(Leg(1.0), ON), (Leg(1.4, speed_mps=0.4, sway=1.0), Leg(1.2), ON)],
    ids=["from-rest", "from-a-stop"],
)


@stood
def test_driving_on_shows_the_vertical_that_a_bias_hid(legs: tuple[Leg, ...]) -> None:
    sequence, slam, tracked = driven(*legs)
    first, trajectory = tracked[0].T_map_camera, slam.trajectory()
    assert first is not None
    assert trajectory is not None
    assert tilt_deg(sequence, [first]) > 0.25
    assert tilt_deg(sequence, trajectory) < 0.15


@stood
def test_it_knows_the_biases(legs: tuple[Leg, ...]) -> None:
    _, slam, _ = driven(*legs)
    state = slam._slam.state
    np.testing.assert_allclose(state.gyro_bias, GYRO_BIAS, atol=1e-3)
    np.testing.assert_allclose(state.accelerometer_bias, ACCELEROMETER_BIAS, atol=0.02)


@stood
def test_no_image_becomes_two_keyframes(legs: tuple[Leg, ...]) -> None:
    _, slam, _ = driven(*legs)
    stamps = [keyframe.stamp_ns for keyframe in slam._slam.map.keyframes]
    assert (np.diff(stamps) > 0).all()

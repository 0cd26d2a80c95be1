"""What front ends without a map wait for, in words."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np

from airground.config import Config
from airground.core.messages import GroundImage, MavImage
from airground.core.se3 import SE3
from airground.core.trajectory import Trajectory
from airground.slam.baselines.trajectory_file import TrajectoryFile
from airground.slam.front_end import Tracking
from airground.slam.monocular import MonocularSlam
from airground.slam.rgbd import RgbdSlam
from tests.slam.synthetic_world import ground_sequence, mav_sequence


def blank(image: GroundImage) -> GroundImage:
    return GroundImage(image.stamp_ns, np.full_like(image.colour, 90), image.depth)


def test_a_blank_wall_has_too_few_corners() -> None:
    sequence = ground_sequence(2)
    front_end = RgbdSlam(sequence.calibration, Config(), np.random.default_rng(0))
    answer = front_end.track(blank(sequence.images[0]))  # type: ignore[arg-type]
    assert answer.tracking is Tracking.INITIALIZING
    assert answer.waiting == "an image with 40 corners that have depth: at most 0 so far"
    answer = front_end.track(sequence.images[1])  # type: ignore[arg-type]
    assert (answer.tracking, answer.waiting) == (Tracking.TRACKED, "")


def test_a_camera_that_stays_shows_no_second_view() -> None:
    """Without an IMU, the images alone decide."""
    sequence = mav_sequence(frames=3)
    calibration = replace(sequence.calibration, imu=None)
    front_end = MonocularSlam(calibration, Config(), np.random.default_rng(0))
    images = [MavImage(k, sequence.images[0].image) for k in range(3)]  # type: ignore[union-attr]
    answer = [front_end.track(image) for image in images][-1]
    assert answer.tracking is Tracking.INITIALIZING
    assert re.fullmatch(
        r"a second view from elsewhere: (\d+) of \1 corners are still followed, median motion "
        r"0\.0 px",
        answer.waiting,
    )


def test_a_trajectory_of_another_time_says_which() -> None:
    image = ground_sequence(2).images[0]
    poses = Trajectory.from_poses([10**12, 10**12 + 10**8], [SE3.identity()] * 2)
    answer = TrajectoryFile(poses).track(image)
    assert answer.waiting.endswith("the poses are of 1000.000 to 1000.100 s")

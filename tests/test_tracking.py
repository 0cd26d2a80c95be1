"""What trackers hand over, and what becomes of corrections when frames are left out."""

from __future__ import annotations

import numpy as np
import pytest

from airground.core.camera import PinholeCamera
from airground.core.cloud import Source
from airground.core.messages import (
    ImuNoise,
    ImuSamples,
    MagneticSamples,
    MavImage,
    RobotCalibration,
)
from airground.core.se3 import SE3
from airground.localization.heading import MIN_SAMPLES
from airground.slam.front_end import TrackedPose, Tracking
from airground.tracking import RobotTracker, without
from tests.frames import ground_frame, mav_frame, path


def test_a_frame_left_out_leaves_its_correction_to_the_next_of_its_robot() -> None:
    first, second = path(1), path(2)
    frames = [ground_frame(1, first), ground_frame(2, second), mav_frame(2), ground_frame(3)]
    kept = list(without(frames, {Source.GROUND: {1, 2}}))
    assert [(frame.robot, frame.stamp_ns) for frame in kept] == [
        (Source.MAV, 2),
        (Source.GROUND, 3),
    ]
    assert kept[0].trajectory is None
    assert kept[1].trajectory is second


def test_a_newer_correction_replaces_one_that_was_left_over() -> None:
    old, new = path(1), path(2)
    frames = [ground_frame(1, old), ground_frame(2, new), ground_frame(3)]
    kept = list(without(frames, {Source.GROUND: {1}}))
    assert [frame.trajectory for frame in kept] == [new, None]


class LateFrontEnd:
    """Knows where it is from the given image on: at the origin, a step farther with each."""

    def __init__(self, first: int) -> None:
        self._first = first

    def add_imu(self, samples: ImuSamples) -> None: ...

    def trajectory(self) -> None: ...

    def track(self, image: MavImage) -> TrackedPose:
        if image.stamp_ns < self._first:
            return TrackedPose(image.stamp_ns, Tracking.INITIALIZING, None)
        pose = SE3.from_heading(0.0, (0.2 * image.stamp_ns, 0.0, 0.0))
        return TrackedPose(image.stamp_ns, Tracking.TRACKED, pose)


def test_what_was_measured_before_the_first_pose_says_nothing_about_north() -> None:
    """The attitude of then is unknown: that of the first pose is another one."""
    camera = PinholeCamera(4, 4, 2.0, 2.0, 1.5, 1.5)
    noise = ImuNoise(1e-4, 1e-5, 1e-3, 1e-4)
    calibration = RobotCalibration(camera, SE3.identity(), SE3.identity(), noise)
    tracker = RobotTracker(Source.MAV, calibration, LateFrontEnd(500))  # type: ignore[arg-type]
    norths = []
    for stamp_ns in range(600):
        heading = 2.0 if stamp_ns < 500 else 0.3
        field = 2e-5 * np.array([[np.cos(heading), np.sin(heading), -2.0]])
        tracker.add(MagneticSamples(np.array([stamp_ns]), field))
        frame = tracker.add(MavImage(stamp_ns, np.zeros((4, 4), np.uint8)))
        assert frame is not None
        norths.append(frame.north_rad)
    # A robot says nothing by few samples, either.
    assert norths[: 500 + MIN_SAMPLES - 1] == [None] * (500 + MIN_SAMPLES - 1)
    assert norths[500 + MIN_SAMPLES :] == pytest.approx([0.3] * (100 - MIN_SAMPLES), abs=1e-6)

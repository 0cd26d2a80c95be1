"""What is kept of a front end's answers while a recording is run."""

from __future__ import annotations

import numpy as np

from airground.core.messages import ImuSamples, MavImage
from airground.core.se3 import SE3
from airground.core.trajectory import Trajectory
from airground.slam.front_end import TrackedCorners, TrackedPose, Tracking
from evaluation.table.tracking_log import WatchedFrontEnd

CORNERS = TrackedCorners(np.zeros((3, 2), np.float32), np.array([True, False, True]))


class Standing:
    """A front end that is always at the same place, and follows three corners."""

    def add_imu(self, samples: ImuSamples) -> None:
        """Nothing to learn from them."""

    def track(self, image: MavImage) -> TrackedPose:
        return TrackedPose(image.stamp_ns, Tracking.TRACKED, SE3.identity(), corners=CORNERS)

    def finish(self) -> None:
        """Nothing was put off."""

    def trajectory(self) -> Trajectory | None:
        return None


def test_corners_are_passed_on_and_not_kept() -> None:
    watched: WatchedFrontEnd[MavImage] = WatchedFrontEnd(Standing())
    said = watched.track(MavImage(5, np.zeros((4, 4), np.uint8)))
    assert said.corners is CORNERS
    (kept,) = watched.log().answers
    assert kept.corners is None
    assert (kept.stamp_ns, kept.tracking) == (said.stamp_ns, said.tracking)


def test_an_image_takes_as_long_as_its_clock_says_inertial_samples_included() -> None:
    ticks = iter([1.0, 1.25, 2.0, 2.5, 7.0, 8.0])
    watched: WatchedFrontEnd[MavImage] = WatchedFrontEnd(Standing(), lambda: next(ticks))
    watched.add_imu(ImuSamples(np.zeros(0, np.int64), np.zeros((0, 3)), np.zeros((0, 3))))
    for stamp in (5, 6):
        watched.track(MavImage(stamp, np.zeros((4, 4), np.uint8)))
    assert list(watched.log().durations_ms) == [750.0, 1000.0]

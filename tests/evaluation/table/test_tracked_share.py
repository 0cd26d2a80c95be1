"""From which image on a robot must be tracked, and how much of that it was."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from airground.core.messages import ImuNoise, ImuSamples
from airground.core.se3 import SE3
from airground.slam.front_end import TrackedPose, Tracking
from evaluation.table.tracked_share import first_motion_ns, tracked_share

STEP_NS = 50_000_000
STAMPS = np.arange(200, dtype=np.int64) * STEP_NS
REST_S = 2.0
NOISE = ImuNoise(1e-4, 1e-5, 1e-3, 1e-4)


def moving_from(start_s: float) -> Callable[[int], SE3]:
    """A camera at rest, then at 0.5 m/s."""

    def at(stamp_ns: int) -> SE3:
        return SE3(np.eye(3), [0.5 * max(0.0, stamp_ns * 1e-9 - start_s), 0.0, 0.0])

    return at


def answers(tracked: Callable[[int], bool]) -> list[TrackedPose]:
    states = [Tracking.TRACKED if tracked(i) else Tracking.LOST for i in range(len(STAMPS))]
    return [
        TrackedPose(stamp, state, SE3.identity() if state is Tracking.TRACKED else None)
        for stamp, state in zip(STAMPS.tolist(), states, strict=True)
    ]


def imu(rest_s: float) -> ImuSamples:
    """At rest, then swaying."""
    rng = np.random.default_rng(0)
    stamps = np.arange(0, int(STAMPS[-1]), 5_000_000, dtype=np.int64)
    time_s = stamps * 1e-9
    sway = np.where(time_s > rest_s, np.sin(2 * np.pi * time_s), 0.0)[:, None] * np.ones(3)
    gyro = 0.2 * sway + rng.normal(0, 1e-3, (len(stamps), 3))
    force = np.array([0, 0, 9.81]) + sway + rng.normal(0, 0.01, (len(stamps), 3))
    return ImuSamples(stamps, gyro, force)


def test_images_before_the_first_motion_do_not_count() -> None:
    motion_ns = first_motion_ns(STAMPS, moving_from(REST_S))
    assert motion_ns == pytest.approx(REST_S * 1e9, abs=2 * STEP_NS)
    late = tracked_share(answers(lambda i: STAMPS[i] >= motion_ns), motion_ns)
    early = tracked_share(answers(lambda i: True), motion_ns)
    assert (late.fraction, early.fraction) == (1.0, 1.0)
    assert (late.first_pose_s, early.first_pose_s) == (pytest.approx(motion_ns * 1e-9), 0.0)


def test_images_in_motion_before_the_first_pose_count() -> None:
    share = tracked_share(answers(lambda i: i >= 50 and i != 120), 0)
    assert share.fraction == 149 / 200
    assert share.first_pose_s == pytest.approx(2.5)
    assert share.lost_images == 1


@pytest.mark.parametrize("start_s", [0.0, 0.3])
def test_a_recording_that_begins_in_motion_counts_from_its_first_image(start_s: float) -> None:
    assert first_motion_ns(STAMPS, moving_from(start_s)) == 0


def test_without_truth_the_imu_shows_the_first_motion() -> None:
    found = first_motion_ns(STAMPS, None, imu(REST_S), NOISE)
    assert found == pytest.approx(REST_S * 1e9, abs=1.5e8)
    assert first_motion_ns(STAMPS, lambda stamp: None, imu(REST_S), NOISE) == found
    assert first_motion_ns(STAMPS, None, imu(0.0), NOISE) == 0


def test_without_both_every_image_counts() -> None:
    assert first_motion_ns(STAMPS, None) == 0
    assert first_motion_ns(STAMPS, None, imu(REST_S), None) == 0


def test_a_robot_that_never_moves_counts_from_its_first_image() -> None:
    assert first_motion_ns(STAMPS, lambda stamp: SE3.identity()) == 0
    assert first_motion_ns(STAMPS, None, imu(100.0), NOISE) == 0


def test_a_robot_that_was_never_tracked_has_no_first_pose() -> None:
    share = tracked_share(answers(lambda i: False), 0)
    assert (share.fraction, share.lost_images) == (0.0, 0)
    assert np.isnan(share.first_pose_s)

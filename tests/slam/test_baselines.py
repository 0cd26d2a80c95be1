"""Front ends to compare with: poses from a file, odometry from frame to frame, level starts."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from airground.core.messages import GroundImage, ImuSamples, MavImage
from airground.core.se3 import SE3
from airground.core.trajectory import Trajectory
from airground.slam.baselines.frame_to_frame import FrameToFrame, LevelStart
from airground.slam.baselines.trajectory_file import TrajectoryFile
from airground.slam.front_end import Tracking
from tests.slam.synthetic_world import ground_sequence

STEP_NS = 100_000_000
CALIBRATION = ground_sequence(2).calibration


def poses_along_x(stamps: list[int]) -> Trajectory:
    return Trajectory.from_poses(
        stamps, [SE3(np.eye(3), np.array([stamp / 1e9, 0, 0])) for stamp in stamps]
    )


def image(stamp_ns: int) -> MavImage:
    return MavImage(stamp_ns, np.zeros((2, 2), np.uint8))


@pytest.mark.parametrize(
    ("stamp_ms", "x"),
    [
        (0, 0.0),  # on the first pose
        (130, 0.13),  # between two
        (240, 0.2),  # beside a gap, near the pose before it
        (260, None),  # in the gap
        (560, 0.6),  # in it, near the pose after
        (740, 0.7),  # just after the last
        (760, None),  # too late
        (-60, None),  # too early
    ],
)
def test_poses_of_a_file_are_interpolated_but_not_across_gaps(
    stamp_ms: int, x: float | None
) -> None:
    front_end = TrajectoryFile(poses_along_x([k * STEP_NS for k in (0, 1, 2, 6, 7)]))
    pose = front_end.track(image(stamp_ms * 1_000_000))
    if x is None:
        assert pose.tracking is not Tracking.TRACKED
    else:
        assert pose.T_map_camera is not None
        np.testing.assert_allclose(pose.T_map_camera.translation, [x, 0, 0], atol=1e-9)


def test_a_file_is_initializing_before_its_first_pose_and_lost_after_its_last() -> None:
    front_end = TrajectoryFile(poses_along_x([10 * STEP_NS, 11 * STEP_NS]))
    stamps = [0, 10 * STEP_NS, 20 * STEP_NS]
    states = [front_end.track(image(stamp)).tracking for stamp in stamps]
    assert states == [Tracking.INITIALIZING, Tracking.TRACKED, Tracking.LOST]


def resting(up_imu: np.ndarray, n: int = 20) -> ImuSamples:
    return ImuSamples(np.arange(n) * 5_000_000, np.zeros((n, 3)), np.tile(9.81 * up_imu, (n, 1)))


@given(st.floats(-0.6, 0.6), st.floats(-0.6, 0.6))
def test_a_map_starts_level_where_gravity_is_measured(roll: float, pitch: float) -> None:
    calibration = CALIBRATION
    R_level_body = SE3.from_rotation_vector((roll, pitch, 0.0)).rotation
    start = LevelStart(calibration)
    start.add_imu(resting(R_level_body.T @ calibration.T_body_imu.rotation @ [0, 0, 1.0]))
    T_map_camera = start.T_map_camera()
    true = R_level_body @ (calibration.T_body_imu @ calibration.T_imu_camera).rotation
    np.testing.assert_allclose(T_map_camera.rotation[2], true[2], atol=1e-9)
    np.testing.assert_array_equal(T_map_camera.translation, np.zeros(3))


@pytest.mark.parametrize("scale", [0.5, 2.0])
def test_or_as_the_body_is_taken_to_be_where_the_robot_accelerates(scale: float) -> None:
    calibration = CALIBRATION
    start = LevelStart(calibration)
    start.add_imu(resting(scale * np.array([0.6, 0.0, 0.8])))
    expected = (calibration.T_body_imu @ calibration.T_imu_camera).rotation
    np.testing.assert_allclose(start.T_map_camera().rotation, expected, atol=1e-9)


class Scripted:
    """Returns given motions, and records between which frames."""

    def __init__(self, motions: list[SE3 | None]) -> None:
        self.motions = motions
        self.asked: list[tuple[int, int]] = []

    def align(self, previous: GroundImage, image: GroundImage) -> SE3 | None:
        self.asked.append((previous.stamp_ns, image.stamp_ns))
        return self.motions[len(self.asked) - 1]


FORWARD = SE3(np.eye(3), np.array([0.0, 0.0, 0.01]))
TOO_FAR = SE3(np.eye(3), np.array([0.0, 0.0, 0.5]))
TURNED = SE3.from_rotation_vector((0.0, 1.0, 0.0))


def states_of(motions: list[SE3 | None], stamps_ms: list[int]) -> tuple[list[str], Scripted]:
    sequence = ground_sequence(2)
    aligner = Scripted(motions)
    front_end = FrameToFrame(sequence.calibration, aligner)
    first = sequence.images[0]
    assert isinstance(first, GroundImage)
    tracked = [front_end.track(replace(first, stamp_ns=ms * 1_000_000)) for ms in stamps_ms]
    return [pose.tracking.value for pose in tracked], aligner


@pytest.mark.parametrize("failure", [None, TOO_FAR, TURNED])
def test_a_frame_that_fails_is_lost_and_the_next_is_aligned_with_the_last_good(
    failure: SE3 | None,
) -> None:
    states, aligner = states_of([FORWARD, failure, FORWARD], [0, 33, 66, 100])
    assert states == ["tracked", "tracked", "lost", "tracked"]
    assert aligner.asked[-1] == (33_000_000, 100_000_000)


def test_after_a_second_it_cannot_be_bridged() -> None:
    states, aligner = states_of([FORWARD], [0, 1100, 1133])
    assert states == ["tracked", "lost", "lost"]
    assert aligner.asked == []

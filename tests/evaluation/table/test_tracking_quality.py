"""What is said of a robot's poses, on answers whose errors and gaps are known."""

from __future__ import annotations

import numpy as np
import pytest

from airground.core.messages import GroundImage, ImuSamples, MavImage
from airground.core.se3 import SE3
from airground.core.trajectory import Trajectory
from airground.slam.front_end import ScaleEstimate, TrackedPose, Tracking
from evaluation.setup.condition import Condition
from evaluation.table.row_writer import RowWriter
from evaluation.table.rows import ResultTable
from evaluation.table.tracking_log import Tracked, WatchedFrontEnd
from evaluation.table.tracking_quality import add_tracking, consistency, level_alignment

STEP_NS = 50_000_000
SIGMA_M, SIGMA_RAD = 0.01, 0.002
COVARIANCE = np.diag([SIGMA_M**2] * 3 + [SIGMA_RAD**2] * 3)
T_MAP_WORLD = SE3.from_heading(0.7, [1.0, -2.0, 0.4])


def true_pose(stamp_ns: int) -> SE3:
    angle = stamp_ns * 2 * np.pi / 20e9
    return SE3.from_heading(angle, [2 * np.cos(angle), 2 * np.sin(angle), 0.3 * np.sin(3 * angle)])


def noisy_pose(stamp_ns: int, rng: np.random.Generator) -> SE3:
    """The true pose in the map, off by exactly what `COVARIANCE` says."""
    true = T_MAP_WORLD @ true_pose(stamp_ns)
    turn = SE3.from_rotation_vector(rng.normal(0, SIGMA_RAD, 3))
    rotation = (turn @ SE3(true.rotation, np.zeros(3))).rotation
    return SE3(rotation, true.translation + rng.normal(0, SIGMA_M, 3))


class Answers:
    """A front end that begins after 20 images, is lost for 10 and is right in the end."""

    def __init__(self) -> None:
        rng = np.random.default_rng(0)
        self.poses = [noisy_pose(i * STEP_NS, rng) for i in range(400)]

    def add_imu(self, samples: ImuSamples) -> None:
        """Nothing to learn from them."""

    def track(self, image: MavImage | GroundImage) -> TrackedPose:
        index = image.stamp_ns // STEP_NS
        if index < 20:
            return TrackedPose(image.stamp_ns, Tracking.INITIALIZING, None)
        if 100 <= index < 110:
            return TrackedPose(image.stamp_ns, Tracking.LOST, None)
        scale = ScaleEstimate(0.5 / index, True)
        pose = self.poses[index]
        return TrackedPose(image.stamp_ns, Tracking.TRACKED, pose, COVARIANCE, scale)

    def finish(self) -> None:
        """Nothing was put off."""

    def trajectory(self) -> Trajectory | None:
        stamps = [i * STEP_NS for i in range(20, 400) if not 100 <= i < 110]
        return Trajectory.from_poses(stamps, [true_pose(stamp) for stamp in stamps])


def fed(inner: Answers) -> WatchedFrontEnd:
    front_end: WatchedFrontEnd = WatchedFrontEnd(inner)
    for i in range(400):
        front_end.track(MavImage(i * STEP_NS, np.zeros((2, 2), np.uint8)))
    return front_end


@pytest.fixture(scope="module")
def measured() -> ResultTable:
    out = RowWriter("indoor_a", 1, 0, Condition("best", "slam", "nominal", "known"))
    front_end = fed(Answers())
    add_tracking(out, Tracked("mav", front_end, front_end.trajectory(), True), true_pose)
    return ResultTable.from_rows(out.rows)


def one(table: ResultTable, metric: str) -> float:
    (value,) = table.values("trajectory", metric)
    return float(value)


def test_live_and_final_poses_are_distinguished(measured: ResultTable) -> None:
    assert one(measured, "mav_ate_se3_rmse_m") == pytest.approx(SIGMA_M * 3**0.5, rel=0.1)
    assert one(measured, "mav_final_ate_se3_rmse_m") < 1e-9
    assert abs(one(measured, "mav_final_scale_error")) < 1e-9


def test_waiting_in_motion_counts_and_is_stated_beside(measured: ResultTable) -> None:
    assert one(measured, "mav_initialized_s") == pytest.approx(20 * 0.05)
    assert one(measured, "mav_tracked_fraction") == pytest.approx(370 / 400)


def test_errors_over_time_have_gaps_where_there_was_no_pose(measured: ResultTable) -> None:
    rows = measured.rows("trajectory_error", "mav_error_m")
    assert rows["time_s"].is_monotonic_increasing
    assert np.allclose(np.diff(rows["time_s"]), 0.1)
    missing = rows["time_s"][rows["value"].isna()].to_numpy()
    assert ((missing < 1.0) | ((missing > 4.99) & (missing < 5.5))).all()
    assert len(missing) == 15
    known = rows["value"].dropna().to_numpy()
    assert np.sqrt(np.mean(known**2)) == pytest.approx(SIGMA_M * 3**0.5, rel=0.15)


def test_a_right_covariance_is_found_consistent(measured: ResultTable) -> None:
    assert one(measured, "mav_nees_position") == pytest.approx(1.0, abs=0.15)
    assert one(measured, "mav_nees_pose") == pytest.approx(1.0, abs=0.15)
    assert one(measured, "mav_within_95_pose") == pytest.approx(0.95, abs=0.03)
    assert one(measured, "mav_scale_sigma") == pytest.approx(0.5 / 399)


def test_overconfidence_shows() -> None:
    answers = [
        TrackedPose(a.stamp_ns, a.tracking, a.T_map_camera, 0.25 * COVARIANCE)
        for a in fed(Answers()).answers
        if a.T_map_camera is not None
    ]
    position, pose = consistency(answers, true_pose)
    assert position.nees == pytest.approx(4.0, rel=0.15)
    assert pose.within_95 < 0.5


def test_a_drift_counts_from_where_the_map_begins() -> None:
    """A scale that is off by as much as the covariance says, over a straight path after a second at
    rest: one of three (of six) directions has an error of one standard deviation."""

    def straight(stamp_ns: int, scale: float = 1.0) -> SE3:
        moved_s = max(stamp_ns * 1e-9 - 1.0, 0.0)
        return SE3.from_heading(0.3, [scale * 0.2 * moved_s, 0.0, 0.5])

    answers = []
    for stamp_ns in range(0, 400 * STEP_NS, STEP_NS):
        along = 0.02 * straight(stamp_ns).translation[0]
        covariance = np.diag([along**2, 0.0, 0.0, 0.0, 0.0, 0.0]) + 1e-6 * np.eye(6)
        pose = T_MAP_WORLD @ straight(stamp_ns, 1.02)
        turn = np.kron(np.eye(2), T_MAP_WORLD.rotation)
        answers.append(TrackedPose(stamp_ns, Tracking.TRACKED, pose, turn @ covariance @ turn.T))
    position, pose_ = consistency(answers, straight)
    assert position.nees == pytest.approx(1 / 3, rel=0.1)
    assert pose_.nees == pytest.approx(1 / 6, rel=0.1)


def test_without_covariance_nothing_is_claimed() -> None:
    answers = [TrackedPose(0, Tracking.TRACKED, true_pose(0))] * 5
    position, pose = consistency(answers, true_pose)
    assert np.isnan([position.nees, pose.nees]).all()


def test_level_alignment_undoes_shift_and_heading() -> None:
    truths = [true_pose(i * STEP_NS) for i in range(50)]
    found = level_alignment([T_MAP_WORLD @ true for true in truths], truths)
    assert np.allclose(found.matrix(), T_MAP_WORLD.matrix())


def test_a_robot_that_never_began_counts_as_failed() -> None:
    out = RowWriter("indoor_a", 1, 0, Condition("best", "slam", "nominal", "known"))
    front_end: WatchedFrontEnd = WatchedFrontEnd(Answers())
    for i in range(10):
        front_end.track(MavImage(i * STEP_NS, np.zeros((2, 2), np.uint8)))
    add_tracking(out, Tracked("mav", front_end, None, True), true_pose)
    table = ResultTable.from_rows(out.rows)
    assert np.isnan(one(table, "mav_ate_se3_rmse_m"))
    assert np.isnan(one(table, "mav_initialized_s"))
    assert one(table, "mav_tracked_fraction") == 0.0
    assert len(table.values("timing", "mono_slam")) == 10

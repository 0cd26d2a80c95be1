"""How poses through a fault are judged, and three faults in a recording."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from airground.core.se3 import SE3
from airground.io.recording import Recording
from airground.slam.front_end import TrackedPose, Tracking
from sim.recording.recorder import record
from sim.recording.truth import Truth
from sim.scene import load_scene
from sim.sensors.presets import NOMINAL
from tests.sensor_faults.__main__ import SCENE, SEED, faults_of
from tests.sensor_faults.case import Outcome, judged, outcome, stored

STEP_NS = 33_333_333
START, END = 10, 20
"""Images at which the fault begins and ends."""


class Straight:
    """The truth of a robot that moves 1 cm from image to image."""

    def T_world_camera(self, robot: str, stamp_ns: int) -> SE3:
        return SE3.from_heading(0.0, np.array([0.01 * stamp_ns / STEP_NS, 0.0, 1.0]))


def poses(off_m: Sequence[float | None], sigma_m: float = 0.001) -> list[TrackedPose]:
    """A pose an image, so far from the truth; none where that is None. Its map is turned."""
    T_map_world = SE3.from_heading(0.7, np.array([1.0, 2.0, 0.0]))
    covariance = np.eye(6) * sigma_m**2
    made = []
    for index, off in enumerate(off_m):
        stamp_ns = index * STEP_NS
        if off is None:
            made.append(TrackedPose(stamp_ns, Tracking.LOST, None))
            continue
        shifted = SE3.from_heading(0.0, np.array([0.0, off, 0.0]))
        T_map_camera = T_map_world @ shifted @ Straight().T_world_camera("mav", stamp_ns)
        made.append(TrackedPose(stamp_ns, Tracking.TRACKED, T_map_camera, covariance))
    return made


def judge(off_m: Sequence[float | None], sigma_m: float = 0.001) -> Outcome:
    truth: Truth = Straight()  # type: ignore[assignment]
    return judged(poses(off_m, sigma_m), truth, "mav", START * STEP_NS, END * STEP_NS, 0)


def test_right_poses_are_right() -> None:
    found = judge([0.0] * 30)
    assert (found.images, found.lost) == (20, 0)
    assert found.again_s == 0.0
    assert max(found.step_m, found.off_m, found.silent_s) < 1e-9


def test_withdrawn_poses_are_lost_and_not_wrong() -> None:
    found = judge([*[0.0] * 10, *[None] * 13, *[0.0] * 7])
    assert found.lost == 13
    assert found.again_s == pytest.approx(3 * STEP_NS * 1e-9)
    assert found.silent_s == 0.0


def test_a_jump_that_no_covariance_admits_is_silently_wrong() -> None:
    jumped = [*[0.0] * 12, *[0.2] * 6, *[0.0] * 12]
    found = judge(jumped)
    assert found.step_m == pytest.approx(0.2)
    assert found.off_m == pytest.approx(0.2)
    assert found.silent_s == pytest.approx(6 / 30, abs=1e-3)
    assert judge(jumped, sigma_m=0.1).silent_s == 0.0


def test_a_robot_that_stays_lost_never_comes_again() -> None:
    assert np.isnan(judge([*[0.0] * 10, *[None] * 20]).again_s)


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Recording:
    folder: Path = tmp_path_factory.mktemp("faults")
    return Recording.open(record(load_scene(SCENE), SEED, NOMINAL, folder / SCENE))


@pytest.mark.slow
@pytest.mark.parametrize("robot", ["mav", "ground"])
@pytest.mark.parametrize(("kind", "duration_s"), [("black", 5.0), ("two_imu_gaps", 0.5)])
def test_faults_of_a_recording_do_no_harm(
    recording: Recording, kind: str, duration_s: float, robot: str
) -> None:
    """No silent jump, back within a second, two gaps of the IMU step by at most 1 cm."""
    faults = faults_of(kind, robot, duration_s, recording, 0)
    found = outcome(stored(recording, faults), Truth.open(recording.path), faults)
    assert not found.error
    assert found.silent_s == 0.0
    assert found.again_s < 1.0
    assert found.step_m < 0.01
    if kind == "black":
        assert found.lost >= 150

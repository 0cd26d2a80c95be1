"""One robot alone, from plain folders to trajectories that evo reads."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from evo.tools import file_interface

from airground.core.cloud import Source
from airground.core.se3 import SE3
from airground.core.trajectory import Trajectory
from airground.errors import RecordingError
from airground.io.open_recording import open_robot
from airground.io.tum import read_tum, write_tum
from airground.slam.front_end import ScaleEstimate, TrackedPose, Tracking
from evaluation import cli
from evaluation.run.own_recordings import WELL_KNOWN_SCALE, scale_note
from evaluation.setup import console
from evaluation.table.tracking_log import FrontEndLog
from evaluation.table.true_camera import read_euroc_poses
from tests.evaluation.plain_recordings import stepped, write_euroc_folder, write_tum_folder
from tests.slam.synthetic_world import ground_sequence, mav_sequence

FRAMES = 15


@pytest.fixture(scope="module")
def tum(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_tum_folder(tmp_path_factory.mktemp("tum"), ground_sequence(FRAMES))


@pytest.fixture(scope="module")
def euroc(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_euroc_folder(tmp_path_factory.mktemp("euroc"), mav_sequence(FRAMES))


def airground(*words: object) -> int:
    with pytest.raises(SystemExit) as ended:
        cli.main([str(word) for word in words])
    assert isinstance(ended.value.code, int)
    return ended.value.code


def summary(folder: Path) -> dict[str, Any]:
    return json.loads((folder / "summary.json").read_text())


def test_a_tum_folder_is_tracked_and_measured(tum: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    words = ("track", tum, "--front-end", "opencv", "--out", out)
    assert airground(*words) == console.EXIT_OK
    made = summary(out)
    assert made["layout"] == "tum"
    assert made["pose_frame"] == "camera"
    assert made["tracked_fraction"] == 1.0
    assert made["error"]["final"]["poses"] == FRAMES
    assert made["error"]["final"]["ate_se3_rmse_m"] < 0.005
    assert made["frame_ms"]["median"] > 0
    for name in ("trajectory", "trajectory_live"):
        path = file_interface.read_tum_trajectory_file(str(out / f"{name}.tum"))
        stamps = [image.stamp_ns / 1e9 for image in ground_sequence(FRAMES).images]
        np.testing.assert_allclose(path.timestamps, stamps)


def test_a_clock_that_steps_is_in_the_summary_and_on_the_screen(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for name, step_ns in (("whole", 0), ("stepped", 500_000_000)):
        sequence = stepped(mav_sequence(FRAMES), 10, step_ns)
        folder = write_euroc_folder(tmp_path / name, sequence)
        write_tum(tmp_path / f"{name}.tum", sequence.T_world_camera)
        words = ("track", folder / "mav0", "--front-end", "file")
        out = tmp_path / f"{name}_out"
        assert airground(*words, "--trajectory", tmp_path / f"{name}.tum", "--out", out) == 0
        note, warned = summary(out)["silence_note"], " ".join(capsys.readouterr().err.split())
        if step_ns:
            assert "all sensors are silent from 0.33 to 0.8" in note
            assert "stamps are ahead by about 0.5" in note
            assert f"mav: {note}" in warned
        else:
            assert note is None
            assert "silent" not in warned


def test_an_euroc_folder_is_tracked_and_measured(euroc: Path, tmp_path: Path) -> None:
    """The input has poses of the camera, the output those of the body, as EuRoC states them."""
    sequence = mav_sequence(FRAMES)
    write_tum(tmp_path / "poses.tum", sequence.T_world_camera)
    out = tmp_path / "out"
    words = ("track", euroc / "mav0", "--front-end", "file")
    assert airground(*words, "--trajectory", tmp_path / "poses.tum", "--out", out) == 0
    made = summary(out)
    assert made["pose_frame"] == "body"
    assert made["error"]["live"]["ate_se3_rmse_m"] < 1e-6
    body = read_tum(out / "trajectory.tum")
    T_camera_body = sequence.calibration.T_imu_camera.inverse()
    for index in (0, FRAMES - 1):
        expected = sequence.T_world_camera[index] @ T_camera_body
        np.testing.assert_allclose(body[index].translation, expected.translation, atol=1e-6)
        np.testing.assert_allclose(body[index].rotation, expected.rotation, atol=1e-6)


def test_without_truth_there_is_a_trajectory_but_no_error(tum: Path, tmp_path: Path) -> None:
    folder = tmp_path / "no_truth"
    shutil.copytree(tum, folder, ignore=shutil.ignore_patterns("groundtruth.txt"))
    out = tmp_path / "out"
    words = ("track", folder, "--robot", "ground", "--front-end", "opencv", "--out", out)
    assert airground(*words) == 0
    assert summary(out)["error"] == {"final": None, "live": None}


def test_front_ends_stand_beside_each_other(
    tum: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A trajectory asks for the front end that follows it, beside those that are named."""
    write_tum(tmp_path / "poses.tum", ground_sequence(FRAMES).T_world_camera)
    out = tmp_path / "out"
    words = ("track", tum, "--front-end", "opencv", "--trajectory", tmp_path / "poses.tum")
    assert airground(*words, "--out", out) == console.EXIT_OK
    assert {path.name for path in out.iterdir()} == {"opencv", "file", "front_ends.png"}
    assert summary(out / "file")["error"]["live"]["ate_se3_rmse_m"] < 1e-6
    assert summary(out / "opencv")["tracked_fraction"] == 1.0
    said = capsys.readouterr().out
    assert said.index("front end opencv") < said.index("front end file")


def test_two_robots_in_one_folder_must_be_distinguished(
    small: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ("track", small, "--front-end", "opencv", "--out", tmp_path / "out")
    assert airground(*words) == console.EXIT_ERROR
    assert "holds both robots; give --robot mav or --robot ground" in capsys.readouterr().err
    assert airground(*words, "--robot", "ground") == console.EXIT_OK


BAD_WORDS = {
    "front end of the other robot": (
        ("--robot", "mav", "--front-end", "opencv"),
        "known: slam, file",
    ),
    "front end": (("--front-end", "orb"), "known: slam, open3d, opencv, file"),
    "no file": (("--front-end", "file"), "needs a trajectory"),
    "no such calibration": (("--calibration", "x.yaml"), "x.yaml: this file"),
    "both robots": (("--mav", "x"), "--mav"),
}


@pytest.mark.parametrize("what", BAD_WORDS)
def test_invalid_options_give_a_one_line_error_and_leave_nothing(
    tum: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], what: str
) -> None:
    words, message = BAD_WORDS[what]
    assert airground("track", tum, *words, "--out", tmp_path / "out") == console.EXIT_ERROR
    error = capsys.readouterr().err
    assert error.startswith("airground: error: ")
    assert error.count("\n") == 1
    assert message in error
    assert list(tmp_path.iterdir()) == []


def test_a_plain_folder_of_one_robot_is_named_where_two_are_needed(
    tum: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for verb in ("run", "live"):
        assert airground(verb, tum, "--out", tmp_path / "out") == console.EXIT_ERROR
        assert "of others' folders, track takes one robot's" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


def test_a_quaternion_that_is_not_of_unit_length_is_named(
    euroc: Path, tum: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = (euroc / "mav0/state_groundtruth_estimate0/data.csv").read_text().splitlines()
    fields = text[3].split(",")
    fields[4:8] = ["0.5", "0.5", "0.5", "0.6"]
    (tmp_path / "data.csv").write_text("\n".join([*text[:3], ",".join(fields)]) + "\n")
    with pytest.raises(
        RecordingError, match=rf"data\.csv: the quaternion .*{fields[0]}.* length 1"
    ):
        read_euroc_poses(tmp_path / "data.csv")
    poses = tmp_path / "poses.tum"
    poses.write_text("1.0 0 0 0 0.5 0.5 0.5 0.6\n")
    words = ("track", tum, "--trajectory", poses)
    assert airground(*words, "--out", tmp_path / "out") == console.EXIT_ERROR
    assert "poses.tum:1: the quaternion (qx qy qz qw) must have length 1" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("sigmas", "imu", "expected"),
    [
        ([None], True, ""),  # depth gives the scale
        ([0.2, WELL_KNOWN_SCALE], True, ""),
        ([0.2, 0.034], True, "the scale of the poses is known to 3.4%"),
        ([0.034, np.inf], True, "poses are up to scale: the front end still waited for a climb"),
        ([np.inf], False, "poses are up to scale: there is no IMU"),
    ],
)
def test_what_is_said_of_the_scale(
    sigmas: list[float | None], imu: bool, expected: str, euroc: Path
) -> None:
    recording = open_robot(euroc, Source.MAV)
    if not imu:
        recording = replace(recording, calibration=replace(recording.calibration, imu=None))
    log = FrontEndLog(waiting="a climb")
    for stamp, sigma in enumerate(sigmas):
        scale = None if sigma is None else ScaleEstimate(sigma, sigma < 0.1)
        log.answers.append(TrackedPose(stamp, Tracking.TRACKED, SE3.identity(), scale=scale))
    final = Trajectory.from_poses([0], [SE3.identity()])
    assert scale_note(recording, log, final) == expected
    assert scale_note(recording, log, None) == ""

"""The inspection finds what was put wrong, and nothing where all is right."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from airground.core.cloud import Source
from airground.core.se3 import SE3
from airground.core.trajectory import Trajectory
from airground.errors import InputError
from airground.io.open_recording import open_robot
from airground.io.robot_recording import RobotRecording
from airground.io.tum import format_stamp, read_tum, write_tum
from evaluation import cli
from evaluation.datasets.inspection import inspect_dataset as inspection
from evaluation.datasets.inspection.findings import Finding, Rhythm, Verdict, look_at_stamps
from evaluation.datasets.inspection.inspect_dataset import inspect_dataset
from evaluation.datasets.inspection.photometric import Posed, fit
from evaluation.datasets.plan import Plan, World
from evaluation.datasets.simulated import Simulated
from evaluation.setup import console

Exported = Callable[[str], Path]
APART = 8


def of(findings: list[Finding], part: str, subject: str) -> Finding:
    (found,) = [one for one in findings if (one.part, one.subject) == (part, subject)]
    return found


def wrong(findings: list[Finding]) -> list[tuple[str, str]]:
    return [(one.part, one.subject) for one in findings if one.verdict is Verdict.WRONG]


def airground(*words: object) -> int:
    with pytest.raises(SystemExit) as ended:
        cli.main([str(word) for word in words])
    assert isinstance(ended.value.code, int)
    return ended.value.code


@pytest.fixture
def tum(exported: Exported, tmp_path: Path) -> Path:
    """A copy to put wrong."""
    return Path(shutil.copytree(exported("tum"), tmp_path / "tum"))


@pytest.fixture
def _images_unseen(monkeypatch: pytest.MonkeyPatch) -> None:
    """Truth is not held against images, which takes the most time."""

    def fits(part: str, *_: object) -> Finding:
        return Finding(part, "truth against images", "not looked at")

    monkeypatch.setattr(inspection, "hold_truth_against_images", fits)


def test_a_recording_is_as_it_should_be(small: Path) -> None:
    layout, findings = inspect_dataset(small)
    assert layout == "airground"
    assert wrong(findings) == []
    assert of(findings, "mav", "images").found.startswith("21 at 30.0 Hz")
    assert of(findings, "ground", "IMU").found.startswith("1001 at 200.0 Hz")
    for part in ("mav", "ground"):
        assert "px off" in of(findings, part, "truth against images").found


@pytest.mark.usefixtures("_images_unseen")
def test_the_exit_code_and_the_json_tell_what_is_wrong(
    small: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert airground("inspect", small, "--json") == 0
    assert json.loads(capsys.readouterr().out)["wrong"] == 0
    changed = Path(shutil.copytree(small, tmp_path / "changed"))
    first, second = sorted((changed / "ground" / "rgb").iterdir())[:2]
    shutil.copyfile(first, second)
    assert airground("inspect", changed, "--json") == console.EXIT_FAULT_FOUND
    printed = json.loads(capsys.readouterr().out)
    assert printed["layout"] == "airground"
    (one,) = [finding for finding in printed["findings"] if finding["verdict"] == "wrong"]
    assert one["subject"] == "digests"
    assert "ground/rgb: differs" in one["found"]


@pytest.mark.usefixtures("_images_unseen")
def test_all_recordings_of_a_dataset_are_looked_at(small: Path, tmp_path: Path) -> None:
    worlds = tuple(
        World(scene="small", name="small", digest="", seed=seed, part=part)
        for seed, part in ((0, "train"), (1, "train"), (2, "test"))
    )
    plan = Plan(sensors="nominal", duration_s=None, worlds=worlds)
    (tmp_path / "dataset.json").write_text(plan.model_dump_json())
    for folder in ("train/small_s0", "test/small_s2", "test/small_s7"):
        shutil.copytree(small, tmp_path / folder)
    (tmp_path / "test/small_s2/ground/rgb.txt").write_text("changed")
    layout, findings = inspect_dataset(tmp_path)
    assert layout == "dataset"
    assert of(findings, "", "recordings").found == "2 of 3 planned"
    defects = wrong(findings)
    assert defects[:2] == [("train/small_s1", "recording"), ("test/small_s7", "recording")]
    assert {part.split()[0] for part, _ in defects[2:]} == {"test/small_s2"}
    assert of(findings, "train/small_s0 mav", "images").found.startswith("21 at 30.0 Hz")


def test_what_cannot_be_read_is_a_finding(small: Path, tmp_path: Path) -> None:
    broken = Path(shutil.copytree(small, tmp_path / "broken"))
    (broken / "mav0" / "cam0" / "data.csv").unlink()
    _, findings = inspect_dataset(broken)
    assert wrong(findings) == [("", "readable")]
    _, of_all = inspect_dataset(tmp_path)
    assert wrong(of_all) == [("broken", "readable")]
    empty = tmp_path / "empty"
    empty.mkdir()
    with pytest.raises(InputError, match=r"holds no recording; expected .*a dataset of ours"):
        inspect_dataset(empty)


def turned(folder: Path, vector_deg: tuple[float, float, float]) -> None:
    """Every other true pose is turned in the camera."""
    path = folder / "groundtruth.txt"
    poses = read_tum(path)
    turn = SE3.from_rotation_vector(np.deg2rad(vector_deg))
    changed = [poses[i] @ turn if i >= APART else poses[i] for i in range(len(poses))]
    write_tum(path, Trajectory.from_poses(poses.stamps_ns.tolist(), changed))


def test_a_truth_that_does_not_fit_the_images_is_found(tum: Path) -> None:
    """Some of the pairs are on one side of the change: half of them are enough."""
    assert wrong(inspect_dataset(tum)[1]) == []
    turned(tum, (0.0, 2.0, 0.0))  # 18 px
    assert wrong(inspect_dataset(tum)[1]) == [("ground", "truth against images")]


def test_a_truth_that_carries_images_out_of_each_other_is_found(tum: Path) -> None:
    turned(tum, (0.0, 70.0, 0.0))
    found = of(inspect_dataset(tum)[1], "ground", "truth against images")
    assert found.verdict is Verdict.WRONG
    assert found.found.startswith("the truth maps most of each image out")


def test_a_truth_in_other_axes_is_found(tum: Path) -> None:
    """The pose of a body with x forward, in place of a camera's."""
    body = SE3(np.array([[0.0, -1, 0], [0, 0, -1], [1, 0, 0]]), np.zeros(3))
    rewritten(tum, lambda T: T @ body)
    assert wrong(inspect_dataset(tum)[1]) == [("ground", "truth against images")]


def rewritten(folder: Path, change: Callable[[SE3], SE3]) -> None:
    """Every true pose, changed."""
    path = folder / "groundtruth.txt"
    poses = read_tum(path)
    changed = [change(poses[i]) for i in range(len(poses))]
    write_tum(path, Trajectory.from_poses(poses.stamps_ns.tolist(), changed))


def test_a_mirrored_truth_is_named(tum: Path) -> None:
    """ICL-NUIM's poses have a y axis that points up."""
    mirror = np.diag([1.0, -1.0, 1.0])
    rewritten(tum, lambda T: SE3(mirror @ T.rotation @ mirror, mirror @ T.translation))
    found = of(inspect_dataset(tum)[1], "ground", "truth against images")
    assert found.verdict is Verdict.WRONG
    assert "mirrored it is 0." in found.found
    assert found.found.endswith("negate ty, qx and qz")


def test_another_depth_scale_than_stated_is_found(tum: Path) -> None:
    def opener(path: Path, robot: Source) -> RobotRecording:
        return open_robot(path, robot, depth_units_per_m=1000.0)

    found = of(inspect_dataset(tum, opener)[1], "ground", "depth")
    assert found.verdict is Verdict.WRONG
    assert found.found.endswith("it looks like 5000 per metre read as 1000")


def as_seven_scenes(tum: Path, folder: Path) -> Path:
    """The same frames, numbered, with poses and depth in that form."""
    folder.mkdir()
    poses = read_tum(tum / "groundtruth.txt")
    for number, stamp in enumerate(poses.stamps_ns.tolist()):
        name = folder / f"frame-{number:06d}"
        for kind, kept in (("rgb", "color.png"), ("depth", "depth.png")):
            shutil.copy(tum / kind / f"{format_stamp(stamp)}.png", f"{name}.{kept}")
        np.savetxt(f"{name}.pose.txt", poses[number].matrix())
    yaml = (tum / "calibration.yaml").read_text()
    (folder / "calibration.yaml").write_text(yaml + "depth_units_per_m: 5000\n")
    return folder


def test_a_seven_scenes_folder_is_inspected_with_its_truth(tum: Path, tmp_path: Path) -> None:
    folder = as_seven_scenes(tum, tmp_path / "seq-01")
    layout, findings = inspect_dataset(folder)
    assert layout == "7scenes"
    assert wrong(findings) == []
    assert of(findings, "ground", "truth").found == "known for 100 % of the images"
    assert "px off" in of(findings, "ground", "truth against images").found
    (folder / "frame-000003.pose.txt").write_text("1 0 0 0\n0 1 0 0\n")
    (_, message) = wrong(inspect_dataset(folder)[1])[0], inspect_dataset(folder)[1][-1].found
    assert "frame-000003.pose.txt" in message


def test_both_robots_of_a_bag_are_inspected(exported: Exported) -> None:
    layout, findings = inspect_dataset(exported("mcap") / "recording")
    assert layout == "ros"
    assert wrong(findings) == []
    for part in ("mav", "ground"):
        assert of(findings, part, "images").found.startswith("21 at 30.0 Hz")
    assert of(findings, "mav", "IMU").found.startswith("1001 at 200.0 Hz")


def test_missing_images_are_counted(tum: Path) -> None:
    for name in ("rgb.txt", "depth.txt"):
        lines = (tum / name).read_text().splitlines()
        (tum / name).write_text("\n".join(lines[:5] + lines[8:]) + "\n")
    found = of(inspect_dataset(tum)[1], "ground", "images")
    assert found.verdict is Verdict.NOTED
    assert "18 at 30.0 Hz" in found.found
    assert "3 missing, longest gap 0.133 s" in found.found


@pytest.mark.usefixtures("_images_unseen")
def test_a_clock_that_steps_is_found(exported: Exported) -> None:
    """All streams have the same gap; with one of them alone, only that is wrong."""
    folder = exported("euroc") / "mav0"

    def opener(path: Path, robot: Source, of_images: bool) -> RobotRecording:
        whole = open_robot(path, robot)
        assert whole.imu is not None
        at_ns = int(whole.camera_stamps[10])

        def said(stamps: np.ndarray) -> np.ndarray:
            return np.where(stamps > at_ns, stamps + 400_000_000, stamps)

        imu = replace(whole.imu, stamps_ns=said(whole.imu.stamps_ns))
        stamps = said(whole.camera_stamps) if of_images else whole.camera_stamps
        return replace(whole, imu=imu, magnetic=None, camera_stamps=stamps)

    for of_images in (True, False):
        _, findings = inspect_dataset(folder, partial(opener, of_images=of_images))
        assert of(findings, "mav", "IMU").verdict is Verdict.WRONG
        clock = [one.found for one in findings if one.subject == "clock"]
        assert len(clock) == of_images
        assert all("all sensors are silent from 0.33 to 0.7" in found for found in clock)


def test_a_long_gap_is_wrong() -> None:
    stamps = np.arange(100, dtype=np.int64) * 5_000_000
    stamps[50:] += 60_000_000
    assert look_at_stamps("mav", "IMU", stamps).verdict is Verdict.WRONG
    rhythm = Rhythm.of(stamps)
    assert (rhythm.missing, rhythm.rate_hz) == (12, pytest.approx(200.0))
    assert rhythm.longest_gap_s == pytest.approx(0.065)


@pytest.mark.parametrize("offset", [(0.0, 0.0), (3.0, 0.0), (0.0, -5.0), (-14.0, 9.0)])
@pytest.mark.parametrize("robot", ["mav", "ground"])
def test_the_error_is_measured_in_pixels(
    simulated: Simulated, robot: str, offset: tuple[float, float]
) -> None:
    """A second pose that is wrong by so many pixels is found to be off by as many."""
    truth, recording = simulated.truth, simulated.recording
    stamps = simulated.stamps_ns(robot)  # type: ignore[arg-type]
    camera = truth.lens(robot).pinhole()  # type: ignore[arg-type]
    posed = []
    for index in (2, 2 + APART):
        if robot == "mav":
            grey = recording.of(Source.MAV).read_image(index).image
        else:
            colour = recording.of(Source.GROUND).read_image(index).colour
            grey = colour.mean(axis=2).astype(np.uint8)
        depth = truth.depth(robot, stamps[index])  # type: ignore[arg-type]
        posed.append(Posed(grey, depth, truth.T_world_camera(robot, stamps[index])))  # type: ignore[arg-type]
    x, y = offset
    turn = SE3.from_rotation_vector((-y / camera.fy, x / camera.fx, 0.0))
    moved = Posed(posed[1].grey, posed[1].depth, posed[1].T_world_camera @ turn)
    found = fit(posed[0], moved, camera)
    assert found is not None
    assert found.rise > 1.1
    np.testing.assert_allclose(found.offset_px, offset, atol=0.4)

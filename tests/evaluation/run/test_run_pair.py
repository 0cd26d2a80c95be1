"""Recordings of a user's own: exports are read back the same, and files replace stages."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import open3d as o3d
import pytest

from airground.config import Config
from airground.core.cloud import PointCloud, Source
from airground.core.se3 import SE3
from airground.core.trajectory import Trajectory
from airground.errors import InputError, RecordingError
from airground.io.digests import file_digest
from airground.io.open_recording import open_robot
from airground.io.ply import read_ply, write_ply
from airground.io.recording import Recording
from airground.io.robot_recording import Pair
from airground.io.tum import read_tum, write_tum
from evaluation import cli
from evaluation.datasets.formats import FORMATS, robots_for
from evaluation.datasets.simulated import Simulated
from evaluation.run.given_map import read_map
from evaluation.run.own_pair import run_pair
from evaluation.setup import console
from evaluation.setup.setups import Given, Setup
from sim.recording.recorder import record
from sim.scene import load_scene
from sim.sensors.presets import NOMINAL
from tests.evaluation.plain_recordings import (
    content,
    stepped,
    write_euroc_folder,
    write_tum_folder,
)
from tests.evaluation.show.scripted_run import ReadBack
from tests.slam.synthetic_world import ground_sequence, mav_sequence

FRAMES = 12


@pytest.fixture(scope="module")
def tum(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_tum_folder(tmp_path_factory.mktemp("tum"), ground_sequence(FRAMES))


@pytest.fixture(scope="module")
def euroc(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_euroc_folder(tmp_path_factory.mktemp("euroc"), mav_sequence(FRAMES))


@pytest.fixture(scope="module")
def mav_poses(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The flight is too short for poses of its own."""
    file = tmp_path_factory.mktemp("poses") / "mav.tum"
    write_tum(file, mav_sequence(FRAMES).T_world_camera)
    return file


def airground(*words: object) -> int:
    with pytest.raises(SystemExit) as ended:
        cli.main([str(word) for word in words])
    assert isinstance(ended.value.code, int)
    return ended.value.code


def exported(path: Path, out: Path) -> Pair:
    """A recording exported and read back."""
    simulated = Simulated.open(path)
    for name in ("euroc", "tum"):
        (out / name).mkdir()
        FORMATS[name].write(out / name, simulated, robots_for(name, None))
    return Pair(open_robot(out / "euroc", Source.MAV), open_robot(out / "tum", Source.GROUND))


def test_an_export_is_read_back_message_by_message(small: Path, tmp_path: Path) -> None:
    """Messages are equal to the bit, and so is every result from them."""
    recording, pair = Recording.open(small), exported(small, tmp_path)
    ours, back = list(recording.messages()), list(pair.messages())
    assert len(ours) == len(back) == 2 * 3 * 21
    for one, other in zip(ours, back, strict=True):
        assert one.robot == other.robot
        assert type(one.message) is type(other.message)
        for a, b in zip(content(one.message), content(other.message), strict=True):
            np.testing.assert_array_equal(a, b)


def test_the_calibration_of_an_export_is_read_back(small: Path, tmp_path: Path) -> None:
    recording, pair = Recording.open(small), exported(small, tmp_path)
    for robot in Source:
        ours, back = recording.of(robot).calibration, pair.of(robot).calibration
        assert ours.camera == back.camera
        assert ours.imu == back.imu
        np.testing.assert_array_equal(ours.T_imu_camera.matrix(), back.T_imu_camera.matrix())
        # Plain folders lack the pose of the body; its up direction comes from the accelerometer.
        up = ours.T_body_imu.rotation.T[:, 2] @ back.T_body_imu.rotation.T[:, 2]
        assert np.rad2deg(np.arccos(min(up, 1.0))) < 15  # the MAV leans into its flight


def test_both_plain_folders_run(
    tum: Path, euroc: Path, mav_poses: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    words = ["run", "--mav", euroc, "--ground", tum, "--heading", "search", "--out", out]
    words += ["--mav-trajectory", mav_poses]
    assert airground(*words) == console.EXIT_OK
    made = json.loads((out / "summary.json").read_text())
    assert made["schema"] == "airground-pair"
    assert made["replaced"] == "MAV poses from a file"
    for robot, layout in (("mav", "euroc"), ("ground", "tum")):
        assert made["robots"][robot]["images"] == FRAMES
        assert made["robots"][robot]["layout"] == layout
    assert made["aerial_surfaces"] == made["located"] == made["alignments"] == 0
    assert (made["not_located"], made["refused"]) == ({}, {})
    assert re.match(r"no surface: the MAV's camera moved \d\.\d\d m while it was tr", made["why"])
    assert made["why"] in " ".join(capsys.readouterr().out.split())
    assert made["robots"]["ground"]["tracked_fraction"] == 1.0
    assert made["robots"]["ground"]["error"]["final"]["ate_se3_rmse_m"] < 0.02
    assert len(read_tum(out / "ground.tum")) == FRAMES
    cloud, _ = read_ply(out / "augmented_map.ply")
    assert sum(made["map_points"].values()) == len(cloud)
    assert (out / "config.toml").exists()


@pytest.mark.parametrize("verb", ["track", "run"])
def test_no_tracked_image_is_an_error_with_its_reason(
    verb: str, tum: Path, euroc: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words: tuple[object, ...] = ("track", euroc)
    if verb == "run":
        words = ("run", "--mav", euroc, "--ground", tum, "--heading", "search")
    assert airground(*words, "--out", tmp_path / "out") == console.EXIT_ERROR
    error = capsys.readouterr().err.splitlines()[-1]
    assert re.search(
        r"none of the 12 images \(0\.4 s\) of the mav was tracked; the front end still waited for "
        r"a second view from elsewhere: \d+ of \d+ corners are still followed, median motion",
        error,
    ), error
    assert not list(tmp_path.iterdir())


def test_rerun_without_truth_shows_the_rest_and_changes_no_result(
    tum: Path, euroc: Path, mav_poses: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["run", "--mav", euroc, "--ground", tum, "--heading", "search"]
    words += ["--mav-trajectory", mav_poses]
    drawn, plain = tmp_path / "drawn", tmp_path / "plain"
    assert (
        airground(*words, "--rerun", "--set", "rerun.level=all", "--out", drawn) == console.EXIT_OK
    )
    assert airground(*words, "--out", plain) == console.EXIT_OK
    for name in ("augmented_map.ply", "ground.tum"):
        assert file_digest(drawn / name) == file_digest(plain / name)
    assert not (plain / "run.rrd").exists()
    assert airground("view", drawn, "--save", tmp_path / "saved.rrd") == console.EXIT_OK
    assert airground("gallery", drawn, "--out", tmp_path / "pictures") == console.EXIT_ERROR
    assert "held against a truth" in capsys.readouterr().err
    read = ReadBack(tmp_path / "saved.rrd")
    assert read.entities >= {
        *("/ground/camera", "/ground/camera/image", "/ground/path", "/ground/map"),
        *("/mav/camera/image", "/events"),
    }
    assert not [entity for entity in read.entities if entity.startswith("/truth")]
    for robot in ("mav", "ground"):
        assert len(read.stamps_ns(f"/{robot}/camera/image")) >= FRAMES
    (tracked,) = [t for t in read.values("/events", "TextLog:text") if "ground robot: tr" in t[0]]
    assert tracked == ["ground robot: tracked"]


def test_files_replace_stages_and_the_summary_names_them(
    tum: Path, euroc: Path, tmp_path: Path
) -> None:
    """Poses and map are those of the files, unchanged."""
    write_tum(tmp_path / "mav.tum", mav_sequence(FRAMES).T_world_camera)
    write_tum(tmp_path / "ground.tum", ground_sequence(FRAMES).T_world_camera)
    points = np.random.default_rng(0).uniform(0, 2, (500, 3)).astype(np.float32)
    write_ply(tmp_path / "map.ply", PointCloud(points, np.full((500, 3), 9, np.uint8)))
    words = ["run", "--mav", euroc, "--ground", tum, "--heading", "search"]
    words += ["--mav-trajectory", tmp_path / "mav.tum"]
    words += ["--ground-trajectory", tmp_path / "ground.tum"]
    words += ["--ground-map", tmp_path / "map.ply", "--out", tmp_path / "out"]
    assert airground(*words) == console.EXIT_OK
    made = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert made["replaced"] == "MAV poses, ground poses, ground map from a file"
    assert made["robots"]["mav"]["tracked_fraction"] == 1.0
    given, left = (read_tum(tmp_path / name) for name in ("ground.tum", "out/ground.tum"))
    np.testing.assert_allclose(left.translations, given.translations, atol=1e-8)
    cloud, sources = read_ply(tmp_path / "out" / "augmented_map.ply")
    assert sources is not None
    of_ground = cloud.points[sources == Source.GROUND]
    assert {tuple(p) for p in of_ground.tolist()} == {tuple(p) for p in points.tolist()}


def test_the_robot_whose_clock_steps_is_named(
    tum: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    sequence = stepped(mav_sequence(FRAMES), 6, 300_000_000)
    euroc = write_euroc_folder(tmp_path / "euroc", sequence)
    write_tum(tmp_path / "mav.tum", sequence.T_world_camera)
    write_tum(tmp_path / "ground.tum", ground_sequence(FRAMES).T_world_camera)
    words = ["run", "--mav", euroc, "--ground", tum, "--heading", "search"]
    words += ["--mav-trajectory", tmp_path / "mav.tum"]
    words += ["--ground-trajectory", tmp_path / "ground.tum", "--out", tmp_path / "out"]
    assert airground(*words) == console.EXIT_OK
    robots = json.loads((tmp_path / "out" / "summary.json").read_text())["robots"]
    note = robots["mav"]["silence_note"]
    assert "all sensors are silent from 0.2" in note
    assert robots["ground"]["silence_note"] is None
    assert f"mav: {note}" in " ".join(capsys.readouterr().err.split())


REFUSED: dict[str, tuple[list[str], str]] = {
    "nothing": ([], "give either RECORDING, or both --mav DIR and --ground DIR"),
    "one": (["--mav", "EUROC"], "give either RECORDING, or both"),
    "too much": (["EUROC", "--mav", "EUROC", "--ground", "TUM"], "give either RECORDING"),
    "no compass": (["--mav", "EUROC", "--ground", "TUM"], "no magnetometer .* --heading search"),
    "map without poses": (
        ["--mav", "EUROC", "--ground", "TUM", "--ground-map", "x.ply"],
        "--ground-map: needs --ground-trajectory",
    ),
    "oracle": (["--mav", "EUROC", "--ground", "TUM", "--poses", "oracle"], "--poses oracle: needs"),
    "drops": (["--mav", "EUROC", "--ground", "TUM", "--drops", "x.json"], "--drops: needs"),
    "swapped": (["--mav", "EUROC", "--ground", "EUROC"], "has no depth images"),
    "calibration": (
        ["EUROC", "--mav-calibration", "x.yaml"],
        "alone --mav-calibration, --gro",
    ),
}


@pytest.mark.parametrize("what", REFUSED)
def test_invalid_options_are_refused(
    what: str, tum: Path, euroc: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words, pattern = REFUSED[what]
    places = {"EUROC": str(euroc), "TUM": str(tum)}
    out = tmp_path / "out"
    code = airground("run", *(places.get(word, word) for word in words), "--out", out)
    assert code == console.EXIT_ERROR
    error = capsys.readouterr().err
    assert re.search(pattern, error), error
    assert not list(tmp_path.iterdir())


def test_a_ground_recording_that_starts_too_late_is_refused(tum: Path, euroc: Path) -> None:
    mav, ground = open_robot(euroc, Source.MAV), open_robot(tum, Source.GROUND)
    late = replace(ground, camera_stamps=ground.camera_stamps + 10**15)
    with pytest.raises(RecordingError, match="same clock"):
        Pair(mav, late)
    Pair(mav, replace(ground, camera_stamps=ground.camera_stamps - 10**15))


def box() -> o3d.geometry.TriangleMesh:
    return o3d.geometry.TriangleMesh.create_box(1.0, 2.0, 0.5)


@pytest.mark.parametrize("ascii_", [True, False])
def test_maps_of_any_kind_are_read(tmp_path: Path, ascii_: bool) -> None:
    file = tmp_path / "mesh.ply"
    o3d.io.write_triangle_mesh(str(file), box(), write_ascii=ascii_)
    cloud = read_map(file)
    np.testing.assert_allclose(np.sort(cloud.points, 0), np.sort(np.asarray(box().vertices), 0))
    assert (cloud.colours == 128).all()


def test_invalid_maps_are_refused(tmp_path: Path) -> None:
    file = tmp_path / "map.ply"
    header = "ply\nformat ascii 1.0\nelement vertex {}\n" + "".join(
        f"property float {axis}\n" for axis in "xyz"
    )
    bad = {
        "4000000000": ("0 0 0", "truncated"),
        "-1": ("0 0 0", "cannot read the PLY header line"),
        "0": ("", "no points"),
        "1": ("nan 0 0", "finite"),
        "2": ("0 0 0\n4000 0 0", "expected metres"),
    }
    for count, (points, message) in bad.items():
        file.write_text(header.format(count) + f"end_header\n{points}\n")
        with pytest.raises(InputError, match=message):
            read_map(file)
    file.write_text("OFF\n")
    with pytest.raises(InputError, match="is no PLY file"):
        read_map(file)
    with pytest.raises(InputError, match=r"none\.ply: cannot be read"):
        read_map(tmp_path / "none.ply")


def test_poses_from_a_file_do_not_count_as_slam() -> None:
    path = Trajectory.from_poses([0], [SE3.identity()])
    setup = Setup(Config(), given=Given(mav=path))
    assert setup.slam_robots() == {"ground"}
    assert setup.given.describe() == "MAV poses from a file"


@pytest.mark.slow(minutes=2)
@pytest.mark.subject(but={"airground/slam": "both runs have the same"})
def test_a_round_trip_gives_the_same_result(tmp_path: Path) -> None:
    """Exported, imported and run: the map and the paths of the native run, to the last byte."""
    path = record(load_scene("tiny"), 0, NOMINAL, tmp_path / "tiny", 22.0)
    assert airground("run", path, "--out", tmp_path / "native") == console.EXIT_OK
    result = run_pair(exported(path, tmp_path), Setup(Config()), 0)
    assert result.events.alignments
    native, _ = read_ply(tmp_path / "native" / "augmented_map.ply")
    np.testing.assert_array_equal(result.augmented.cloud_ground.points, native.points)
    write_ply(tmp_path / "back.ply", result.augmented.cloud_ground, result.augmented.sources)
    digests = [file_digest(tmp_path / f) for f in ("native/augmented_map.ply", "back.ply")]
    assert digests[0] == digests[1]

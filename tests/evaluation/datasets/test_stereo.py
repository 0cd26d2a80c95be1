"""Stereo pairs added to a recording: the left image is the recorded one, and disparity is depth."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
import yaml

from airground.core.se3 import SE3
from airground.errors import InputError
from evaluation.cli import answer
from evaluation.datasets.pixel_truth_files import Wanted
from evaluation.datasets.simulated import Simulated
from evaluation.datasets.stereo_files import flight_of, render_stereo
from sim.recording import recorder
from sim.recording.frames import FrameMaker
from sim.recording.recorder import record
from sim.recording.redraw import redrawn
from sim.robots.motion import ROBOTS, Robot
from sim.scene import parse_scene
from sim.sensors.presets import REAL
from tests.evaluation.conftest import images_in_flight
from tests.sim.small_flight import SCENE, unpainted

BASELINE_M = 0.2


@pytest.fixture(scope="module", autouse=True)
def _few_images() -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(recorder, "image_stamps", images_in_flight)
        yield


@pytest.fixture(scope="module")
def scene_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    file = tmp_path_factory.mktemp("scene") / "small.toml"
    file.write_text(SCENE)
    return file


@pytest.fixture(scope="module")
def pairs(simulated: Simulated, scene_file: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Right images of all frames of both robots."""
    out = tmp_path_factory.mktemp("stereo")
    words = ["render", str(simulated.recording.path), "--add", "stereo"]
    options = ["--baseline", str(BASELINE_M), "--scene", str(scene_file), "--out", str(out)]
    assert answer([*words, *options]) in (None, 0)
    return out


def test_files_are_those_of_a_euroc_camera(pairs: Path, simulated: Simulated) -> None:
    for robot in ROBOTS:
        folder = pairs / f"{robot}_stereo"
        stamps = simulated.stamps_ns(robot)
        lines = (folder / "data.csv").read_text().splitlines()[1:]
        assert lines == [f"{stamp},{stamp}.png" for stamp in stamps]
        assert sorted(int(f.stem) for f in (folder / "data").iterdir()) == stamps
        stated = yaml.safe_load((folder / "sensor.yaml").read_text())
        T_imu_right = SE3.from_matrix(np.array(stated["T_BS"]["data"]).reshape(4, 4))
        T_left_right = simulated.T_imu_camera(robot).inverse() @ T_imu_right
        np.testing.assert_allclose(T_left_right.translation, [BASELINE_M, 0, 0], atol=1e-9)
        assert T_left_right.angle() < 1e-9
        assert stated["intrinsics"][0] == simulated.nominal(robot).camera.fx


@pytest.mark.parametrize("robot", ROBOTS)
def test_disparity_agrees_with_true_depth(robot: Robot, pairs: Path, simulated: Simulated) -> None:
    truth, index = simulated.truth, len(simulated.stamps_ns(robot)) // 2
    stamp = simulated.stamps_ns(robot)[index]
    left, right = (
        cv2.imread(str(file), cv2.IMREAD_GRAYSCALE)
        for file in (
            simulated.image_files(robot)[index],
            pairs / f"{robot}_stereo/data/{stamp}.png",
        )
    )
    depth = truth.depth(robot, stamp)
    true_px = truth.lens(robot).intrinsics[0] * BASELINE_M / depth
    matcher = cv2.StereoSGBM.create(
        0, 192, 5, P1=200, P2=800, disp12MaxDiff=1, uniquenessRatio=10, speckleWindowSize=100,
        speckleRange=2, mode=cv2.STEREO_SGBM_MODE_SGBM_3WAY,
    )  # fmt: skip
    found_px = matcher.compute(left, right).astype(float) / 16
    known = (found_px > 0) & np.isfinite(true_px) & (true_px < 190)
    assert known.mean() > 0.3
    assert np.median(abs(found_px - true_px)[known]) < 0.5


def test_left_images_drawn_anew_are_the_recorded_ones(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With the rolling shutters and lenses of `real`; the right ones by two processes as by one."""
    monkeypatch.setattr(recorder, "painted", unpainted)
    scene = parse_scene(SCENE, "small.toml")
    simulated = Simulated.open(record(scene, 5, REAL, tmp_path / "recording", workers=1))
    recording = simulated.recording
    (tmp_path / "small.toml").write_text(SCENE)
    flight = flight_of(recording.header, str(tmp_path / "small.toml"))
    with redrawn(recording, flight, ROBOTS) as plan, FrameMaker(plan) as maker:
        for robot in ROBOTS:
            for index, file in enumerate(simulated.image_files(robot)):
                stored = cv2.imread(str(file), cv2.IMREAD_UNCHANGED)
                stored = stored if robot == "mav" else stored[..., ::-1]
                np.testing.assert_array_equal(maker.picture(robot, index), stored)
        with FrameMaker(replace(plan, baseline_m=BASELINE_M)) as right:
            expected = right.picture("mav", 2)
    wanted, counted = Wanted(("mav",), (), every=2), list[int]()
    file = str(tmp_path / "small.toml")
    render_stereo(simulated, wanted, BASELINE_M, file, tmp_path, 2, counted.append)
    written = sorted((tmp_path / "mav_stereo/data").iterdir())
    assert sum(counted) == len(written) == -(-len(simulated.stamps_ns("mav")) // 2)
    np.testing.assert_array_equal(cv2.imread(str(written[1]), cv2.IMREAD_UNCHANGED), expected)


def test_another_scene_or_an_unknown_one_is_refused(
    simulated: Simulated, scene_file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(recorder, "painted", unpainted)
    wanted, before = Wanted(("mav",), ()), sorted((simulated.recording.path / "truth").iterdir())
    other = tmp_path / "other.toml"

    def refused(scene: str | None, words: str) -> None:
        with pytest.raises(InputError, match=words):
            render_stereo(simulated, wanted, 0.1, scene, tmp_path, 1, lambda count: None)

    refused(None, "unknown scene 'small'.*give the file of the scene with --scene")
    other.write_text(SCENE.replace('name = "small"', 'name = "other"'))
    refused(str(other), "its name is 'other', the recording is of 'small'")
    # Without its pictures, the world is another one.
    refused(str(scene_file), "drawn anew, the first mav image differs")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["other.toml"]
    assert sorted((simulated.recording.path / "truth").iterdir()) == before


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--add", "depth", "--baseline", "0.2"], "only with --add stereo"),
        (["--add", "stereo", "--baseline", "0"], "--baseline 0: must be from 0.001 to 5"),
    ],
)
def test_options_that_do_not_fit(options: list[str], words: str, simulated: Simulated) -> None:
    with pytest.raises(InputError, match=words):
        answer(["render", str(simulated.recording.path), *options])

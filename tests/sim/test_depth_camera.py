"""A Kinect whose depth camera is beside its colour camera: registered by its driver, or raw."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from airground.core.cloud import Source
from airground.core.messages import GroundImage
from airground.core.se3 import SE3
from airground.errors import RecordingError
from airground.io.digests import path_digest
from airground.io.images import depth_units
from airground.io.open_recording import open_robot
from airground.io.recording import Recording
from evaluation.datasets.simulated import Simulated
from evaluation.datasets.tum import write_tum_folder
from sim.recording import recorder
from sim.recording.recorder import record
from sim.recording.truth import Truth
from sim.scene import parse_scene
from sim.sensors.presets import NOMINAL, NONE, REAL, SensorPreset
from sim.sensors.turned import with_depth_camera
from tests.sim.small_flight import SCENE, few_stamps, unpainted

BASELINE_M = 0.05
PERFECT = with_depth_camera(NONE, depth_baseline_m=BASELINE_M)
SHIFTED = replace(REAL, name="real", depth_baseline_m=BASELINE_M)


@pytest.fixture(scope="module", autouse=True)
def _small_recordings() -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(recorder, "image_stamps", few_stamps)
        patch.setattr(recorder, "painted", unpainted)
        yield


def make(folder: Path, preset: SensorPreset) -> Path:
    return record(parse_scene(SCENE, "small.toml"), 3, preset, folder / "recording", workers=1)


@pytest.fixture(scope="module")
def perfect(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return make(tmp_path_factory.mktemp("perfect"), PERFECT)


@pytest.fixture(scope="module")
def raw(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return make(tmp_path_factory.mktemp("raw"), with_depth_camera(SHIFTED, depth_registered=False))


@pytest.fixture(scope="module")
def registered(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return make(tmp_path_factory.mktemp("registered"), SHIFTED)


def images(folder: Path) -> list[GroundImage]:
    robot = Recording.open(folder).ground
    return [robot.read_image(index) for index in range(len(robot.camera_stamps))]


def test_without_errors_registered_depth_is_the_colour_cameras(perfect: Path) -> None:
    truth = Truth.open(perfect)
    for image in images(perfect):
        true = truth.depth("ground", image.stamp_ns)
        both = np.isfinite(true) & np.isfinite(image.depth)
        assert both.mean() > 0.4
        # Each depth is of a place half a pixel off at most.
        slack = 0.6 * sum(abs(slope) for slope in np.gradient(true)) + 2e-3
        assert (abs(image.depth - true) < slack)[both].mean() > 0.99


def test_raw_depth_is_seen_from_its_own_place(tmp_path: Path) -> None:
    folder = make(tmp_path, with_depth_camera(PERFECT, depth_registered=False))
    recording, truth = Recording.open(folder), Truth.open(folder)
    table = recording.header.calibration.ground.depth
    assert table.camera is not None
    assert np.array(table.T_camera_depth)[:3, 3] == pytest.approx([-BASELINE_M, 0, 0])
    stamp = int(recording.ground.camera_stamps[1])
    eye = truth.T_world_camera("ground", stamp) @ SE3(np.eye(3), np.array([-BASELINE_M, 0, 0]))
    true = truth.surface("ground").cast(table.camera.lens().pinhole(), eye)
    name = sorted((folder / "ground/depth").iterdir())[1]
    stored = cv2.imread(str(name), cv2.IMREAD_UNCHANGED) / table.units_per_m
    both = np.isfinite(true) & (stored > 0)
    assert both.mean() > 0.4
    assert np.median(abs(stored - true)[both]) < 2e-4


def test_reading_raw_depth_gives_what_the_driver_gives(raw: Path, registered: Path) -> None:
    half_unit_m = 0.5 / Recording.open(raw).depth_units_per_m
    for one, other in zip(images(raw), images(registered), strict=True):
        np.testing.assert_array_equal(one.colour, other.colour)
        np.testing.assert_array_equal(np.isnan(one.depth), np.isnan(other.depth))
        known = np.isfinite(one.depth)
        assert known.mean() > 0.2
        np.testing.assert_allclose(one.depth[known], other.depth[known], atol=1.01 * half_unit_m)


def test_the_header_states_the_depth_camera_only_where_depth_is_raw(
    raw: Path, registered: Path
) -> None:
    assert "T_camera_depth" in (raw / "recording.toml").read_text()
    assert "T_camera_depth" not in (registered / "recording.toml").read_text()
    assert Truth.open(registered).calibration == Truth.open(raw).calibration
    true, nominal = (
        table.ground.depth
        for table in (Truth.open(raw).calibration, Recording.open(raw).header.calibration)
    )
    assert true.camera is not None
    assert nominal.camera is not None
    assert abs(nominal.camera.fx / true.camera.fx - 1) == pytest.approx(1e-3)
    assert true.camera.readout_s == REAL.ground_optics.readout_s
    poses = [SE3.from_matrix(np.array(table.T_camera_depth)) for table in (true, nominal)]
    assert (poses[0].inverse() @ poses[1]).angle() == pytest.approx(np.deg2rad(0.1))


def test_only_depth_differs_from_a_kinect_of_one_camera(tmp_path: Path) -> None:
    with_baseline = make(tmp_path / "a", with_depth_camera(NOMINAL, depth_baseline_m=0.02))
    without = make(tmp_path / "b", NOMINAL)
    for name in ("mav0", "ground/rgb", "ground/imu0", "truth/motion.npz"):
        files = [path for path in sorted((without / name).rglob("*")) if path.is_file()]
        for file in files or [without / name]:
            other = with_baseline / file.relative_to(without)
            assert path_digest(file) == path_digest(other), file


def test_an_export_has_registered_depth(raw: Path, tmp_path: Path) -> None:
    write_tum_folder(tmp_path, Simulated.open(raw), ("ground",))
    names = sorted(path.name for path in (tmp_path / "depth").iterdir())
    assert names == sorted(path.name for path in (raw / "ground/depth").iterdir())
    units = cv2.imread(str(tmp_path / "depth" / names[0]), cv2.IMREAD_UNCHANGED)
    recording = Recording.open(raw)
    _, depth = recording.images.ground(0)
    np.testing.assert_array_equal(units, depth_units(depth, recording.depth_units_per_m))
    exported = open_robot(tmp_path, Source.GROUND).read_image(0)
    known = np.isfinite(exported.depth)
    assert known.mean() > 0.2


def test_half_a_calibration_is_rejected(raw: Path, tmp_path: Path) -> None:
    text = (raw / "recording.toml").read_text()
    start = text.index("T_camera_depth")
    (tmp_path / "recording.toml").write_text(text[:start] + text[text.index("\n[", start) :])
    with pytest.raises(RecordingError, match="camera and T_camera_depth come together"):
        Recording.open(tmp_path)

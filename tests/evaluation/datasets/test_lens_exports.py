"""Exported lenses see what ours see, in the models of the tools that read them."""

from pathlib import Path
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from airground.core.se3 import SE3
from airground.errors import InputError
from airground.io.calibration import CameraTable
from airground.io.euroc import camera_yaml
from airground.io.lens import Lens
from airground.io.sensor_file import read_lens
from evaluation.datasets.colmap import _camera_line
from evaluation.datasets.nerfstudio import _intrinsics
from evaluation.datasets.ros_messages import camera_info
from evaluation.datasets.simulated import Simulated
from evaluation.datasets.views import PIXEL_CENTRE, choose_views
from sim.sensors.optics import EUROC_RADTAN, KINECT_RADTAN, Optics, Radtan

TABLE = CameraTable(
    width=640, height=480, fx=525, fy=525, cx=319.5, cy=239.5, rate_hz=30, time_offset_ns=0
)
TABLES = {
    "pinhole": TABLE,
    "radtan": Optics("radtan").applied_to(TABLE, EUROC_RADTAN),
    "radtan, k3": Optics("radtan").applied_to(TABLE, KINECT_RADTAN),
    "equidistant": Optics("equidistant", readout_s=0.02).applied_to(TABLE, Radtan((), 1.0)),
}


def simulated(lens: Lens) -> Simulated:
    truth = SimpleNamespace(lens=lambda _: lens)
    return cast(Simulated, SimpleNamespace(truth=truth, recording=SimpleNamespace(path="a")))


@pytest.mark.parametrize("name", TABLES)
def test_colmaps_camera_sees_the_same(name: str) -> None:
    pycolmap = pytest.importorskip("pycolmap", reason="pycolmap is not installed")
    lens = TABLES[name].lens()
    _, model, width, height, *numbers = _camera_line(simulated(lens), "mav").split()
    camera = pycolmap.Camera(
        model=model, width=int(width), height=int(height), params=[float(n) for n in numbers]
    )
    rays = lens.rays()[::80, ::80].reshape(-1, 3)
    pixels = np.asarray(camera.img_from_cam(rays)) - PIXEL_CENTRE
    np.testing.assert_allclose(pixels, lens.project(rays), atol=1e-4)


@pytest.mark.parametrize("name", TABLES)
def test_nerfstudio_names_the_coefficients(name: str) -> None:
    lens = TABLES[name].lens()
    written = _intrinsics(lens)
    fisheye = lens.model == "equidistant"
    assert written["camera_model"] == ("OPENCV_FISHEYE" if fisheye else "OPENCV")
    order = ("k1", "k2", "k3", "k4") if fisheye else ("k1", "k2", "p1", "p2", "k3")
    found = tuple(written.get(key, 0.0) for key in order)
    assert found[: len(lens.distortion)] == lens.distortion
    assert not any(found[len(lens.distortion) :])


@pytest.mark.parametrize("name", TABLES)
def test_sensor_yaml_reads_back(name: str, tmp_path: Path) -> None:
    lens, file = TABLES[name].lens(), tmp_path / "sensor.yaml"
    file.write_text(camera_yaml(TABLES[name], SE3.identity()))
    read = read_lens(file)
    assert (read.model, read.readout_s, read.intrinsics) == (
        lens.model,
        lens.readout_s,
        lens.intrinsics,
    )
    assert read.distortion == (lens.distortion or (0.0,) * 4)


@pytest.mark.parametrize("name", TABLES)
def test_camera_info_has_the_coefficients(name: str) -> None:
    lens = TABLES[name].lens()
    info = camera_info(0, "camera", lens, lens.pinhole())
    assert info.distortion_model == ("equidistant" if name == "equidistant" else "plumb_bob")
    assert tuple(info.d[: len(lens.distortion)]) == lens.distortion


def test_one_pose_an_image_does_not_hold_a_rolling_shutter() -> None:
    with pytest.raises(InputError, match="mav camera has a rolling shutter"):
        choose_views(simulated(TABLES["equidistant"].lens()), ("mav",))


def test_a_table_refuses_coefficients_that_do_not_fit() -> None:
    values = {**TABLE.model_dump(), "distortion_model": "equidistant"}
    with pytest.raises(ValueError, match="expected 4 for equidistant"):
        CameraTable.model_validate({**values, "distortion_coefficients": (0.1,)})
    values["distortion_model"] = "radial-tangential"
    with pytest.raises(ValueError, match="fold back"):
        CameraTable.model_validate({**values, "distortion_coefficients": (-3.0, 0, 0, 0)})
    with pytest.raises(ValueError, match="readout_s"):
        CameraTable.model_validate({**TABLE.model_dump(), "readout_s": 20})

"""Plain EuRoC folders: what is read, and every complaint that a damaged one deserves."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
import pytest

from airground.core.cloud import Source
from airground.core.messages import USUAL_BIAS_MPS2, ImuSamples, MavImage
from airground.errors import RecordingError
from airground.io.open_recording import open_robot
from airground.io.robot_recording import RobotRecording
from tests.io.plain_folders import (
    CAMERA_START_NS,
    HEIGHT,
    IMAGES,
    UP_IMU,
    WIDTH,
    camera_stamps,
    grey_image,
    write_euroc,
    write_imu,
)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return write_euroc(tmp_path / "MH_01_easy")


def mav(folder: Path) -> RobotRecording:
    return open_robot(folder, Source.MAV)


def test_messages_come_in_order_with_samples_before_each_image(folder: Path) -> None:
    recording = mav(folder)
    messages = [stamped.message for stamped in recording.messages()]
    assert {stamped.robot for stamped in recording.messages()} == {Source.MAV}
    images = [m for m in messages if isinstance(m, MavImage)]
    assert [image.stamp_ns for image in images] == camera_stamps()
    assert recording.camera_stamps.tolist() == camera_stamps()
    samples = [m for m in messages if isinstance(m, ImuSamples)]
    assert len(samples) == IMAGES
    assert samples[0].stamps_ns[0] == CAMERA_START_NS - 5_000_000
    assert len(samples[1].stamps_ns) == 10
    np.testing.assert_allclose(samples[1].accelerometer[0], UP_IMU)


def test_images_are_undistorted_to_the_nominal_camera(folder: Path) -> None:
    """A point of the scene lands where the pinhole camera says."""
    recording = mav(folder)
    camera = recording.calibration.camera
    assert (camera.width, camera.height) == (WIDTH, HEIGHT)
    K = np.array([[39.03, 0, 31.25], [0, 38.92, 21.14], [0, 0, 1]])
    coefficients = np.array([-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05])
    ray = np.array([0.3, -0.25, 1.0])
    (seen,), _ = cv2.projectPoints(ray[None], np.zeros(3), np.zeros(3), K, coefficients)
    spot = np.zeros((HEIGHT, WIDTH))
    v, u = np.mgrid[:HEIGHT, :WIDTH]
    spot = 255 * np.exp(-((u - seen[0, 0]) ** 2 + (v - seen[0, 1]) ** 2) / 8)
    file = folder / "mav0" / "cam0" / "data" / f"{camera_stamps()[0]}.png"
    cv2.imwrite(str(file), spot.astype(np.uint8))
    image = recording.read_image(0).image.astype(float)  # type: ignore[union-attr]
    centre = np.array([(image * u).sum(), (image * v).sum()]) / image.sum()
    np.testing.assert_allclose(centre, camera.project(ray[None])[0], atol=0.15)


def test_without_distortion_images_stay_as_they_are(folder: Path) -> None:
    replace(folder, "cam0/sensor.yaml", r"coefficients: .*", "coefficients: [0, 0, 0, 0]")
    recording = mav(folder)
    assert recording.calibration.camera.fx == 39.03
    first = recording.read_image(0)
    assert isinstance(first, MavImage)
    np.testing.assert_array_equal(first.image, grey_image(0))


def test_calibration_follows_the_sensor_files(folder: Path) -> None:
    calibration = mav(folder).calibration
    assert calibration.imu is not None
    assert calibration.imu.gyro_noise_density == 1.6968e-04
    assert calibration.imu.accelerometer_bias_walk == 3.0e-3
    assert calibration.accelerometer_bias_sigma == USUAL_BIAS_MPS2
    with (folder / "mav0/imu0/sensor.yaml").open("a") as file:
        file.write("accelerometer_bias_sigma: 0.02\n")
    assert mav(folder).calibration.accelerometer_bias_sigma == 0.02
    np.testing.assert_allclose(
        calibration.T_imu_camera.translation, [-0.0216401454975, -0.064676986768, 0.00981073058949]
    )
    up = calibration.T_body_imu.rotation @ UP_IMU
    np.testing.assert_allclose(up / np.linalg.norm(up), [0, 0, 1], atol=1e-12)
    ahead = (calibration.T_body_imu @ calibration.T_imu_camera).rotation[:, 2]
    assert ahead[0] > 0.9
    assert abs(ahead[1]) < 0.1


def test_an_imu_that_is_turned_in_the_body_is_taken_into_account(folder: Path) -> None:
    before = mav(folder).calibration.T_imu_camera
    replace(
        folder,
        "imu0/sensor.yaml",
        r"\[1.0, 0.0, 0.0, 0.0,\n +0.0, 1.0, 0.0, 0.0",
        "[0.0, -1.0, 0.0, 0.5, 1.0, 0.0, 0.0, 0.0",
    )
    imu_file = folder / "mav0" / "imu0" / "data.csv"
    lines = imu_file.read_text().splitlines()
    turned = [lines[0]]
    for line in lines[1:]:
        t, *v = line.split(",")
        turned.append(",".join([t, v[1], f"{-float(v[0])}", v[2], v[4], f"{-float(v[3])}", v[5]]))
    imu_file.write_text("\n".join(turned) + "\n")
    after = mav(folder).calibration.T_imu_camera
    x, y, z = before.translation - [0.5, 0, 0]
    np.testing.assert_allclose(after.translation, [y, -x, z], atol=1e-9)


@pytest.mark.parametrize("place", ["", "mav0"])
def test_the_folder_may_be_mav0_or_the_one_that_holds_it(folder: Path, place: str) -> None:
    assert len(mav(folder / place).camera_stamps) == IMAGES


def test_without_an_imu_there_are_only_images(folder: Path) -> None:
    for file in (folder / "mav0" / "imu0").iterdir():
        file.unlink()
    (folder / "mav0" / "imu0").rmdir()
    recording = mav(folder)
    assert recording.calibration.imu is None
    assert all(isinstance(s.message, MavImage) for s in recording.messages())


def replace(folder: Path, file: str, pattern: str, by: str) -> None:
    path = folder / "mav0" / file
    text, n = re.subn(pattern, by, path.read_text())
    assert n
    path.write_text(text)


def scale_stamps(folder: Path, file: str, divisor: int) -> None:
    replace(folder, file, r"(?m)^(\d+),", lambda m: f"{int(m[1]) // divisor},")  # type: ignore[arg-type]


BAD: dict[str, tuple[Callable[[Path], object], str]] = {
    "no calibration": (
        lambda f: (f / "mav0/cam0/sensor.yaml").unlink(),
        r"cam0/sensor\.yaml: this file is missing",
    ),
    "calibration without intrinsics": (
        lambda f: replace(f, "cam0/sensor.yaml", r"intrinsics:.*\n", ""),
        r"cam0/sensor\.yaml: key 'intrinsics' is missing",
    ),
    "distortion model": (
        lambda f: replace(f, "cam0/sensor.yaml", "radial-tangential", "radial-tangental"),
        r"cam0/sensor\.yaml: key 'distortion_model': 'radial-tangental' is unknown; known",
    ),
    "another camera model": (
        lambda f: replace(f, "cam0/sensor.yaml", "camera_model: pinhole", "camera_model: omni"),
        r"'camera_model': 'omni' is unknown; known: pinhole \(fisheye lenses: .* equidistant\)",
    ),
    "three coefficients": (
        lambda f: replace(f, "cam0/sensor.yaml", r", 1\.76.*\]", "]"),
        r"'distortion_coefficients': expected 4 or 5 or 8 or 12 or 14 numbers",
    ),
    "image of another size": (
        lambda f: replace(f, "cam0/sensor.yaml", r"\[64, 48\]", "[752, 480]"),
        r"\.png: is 64x48, the calibration says 752x480",
    ),
    "T_BS not rigid": (
        lambda f: replace(f, "cam0/sensor.yaml", r"-0\.99988", "-1.09988"),
        r"cam0/sensor\.yaml: key 'T_BS': is not rigid",
    ),
    "T_BS mirrored": (
        lambda f: replace(f, "imu0/sensor.yaml", r"\[1\.0, 0\.0", "[-1.0, 0.0"),
        r"imu0/sensor\.yaml: key 'T_BS': is not rigid: .*determinant -1\.000",
    ),
    "camera stamps in microseconds": (
        lambda f: scale_stamps(f, "cam0/data.csv", 1000),
        r"cam0/data\.csv: the stamps step by .* they look like microseconds; expected nanoseconds",
    ),
    "imu stamps in microseconds": (
        lambda f: scale_stamps(f, "imu0/data.csv", 1000),
        r"imu0/data\.csv: .* they look like microseconds; expected nanoseconds",
    ),
    "camera stamps in seconds": (
        lambda f: replace(f, "cam0/data.csv", r"(?m)^(\d{10})(\d{9}),", r"\1.\2,"),
        r"cam0/data\.csv:2: the stamp '1403636579\.763555584' has decimals.*nanoseconds",
    ),
    "imu stamps in seconds": (
        lambda f: replace(f, "imu0/data.csv", r"(?m)^(\d{10})(\d{9}),", r"\1.\2,"),
        r"imu0/data\.csv:2: the stamp '1403636579\.758555584' has decimals.*nanoseconds",
    ),
    "imu ends early": (
        lambda f: write_imu(f / "mav0/imu0/data.csv", samples=20),
        r"imu0/data\.csv: the IMU does not cover the images: it ends 0\.11 s before the last",
    ),
    "imu begins late": (
        lambda f: replace(f, "imu0/data.csv", r"(?s)\n.*?(1403636579913555584,)", r"\n\1"),
        r"imu0/data\.csv: the IMU does not cover the images: it begins 0\.15 s after the first",
    ),
    "gravity of the wrong sign": (
        lambda f: write_imu(f / "mav0/imu0/data.csv", scale=-1.0),
        r"imu0/data\.csv: gravity has the wrong sign",
    ),
    "accelerometer in g": (
        lambda f: write_imu(f / "mav0/imu0/data.csv", scale=1 / 9.81),
        r"imu0/data\.csv: the accelerometer reads 1 m/s\^2 .* expected about 9\.81",
    ),
    "unsorted images": (
        lambda f: replace(f, "cam0/data.csv", r"(\d+,\d+\.png)\s+(\d+,\d+\.png)", r"\2\n\1"),
        r"cam0/data\.csv: stamp 1403636579763555584 \(entry 2\) follows 1403636579813555584",
    ),
    "image missing": (
        lambda f: (f / f"mav0/cam0/data/{camera_stamps()[2]}.png").unlink(),
        rf"{camera_stamps()[2]}\.png: this image is listed in data\.csv but missing",
    ),
    "noise missing": (
        lambda f: replace(f, "imu0/sensor.yaml", "gyroscope_noise_density", "gyro_noise"),
        r"imu0/sensor\.yaml: key 'gyroscope_noise_density' is missing",
    ),
    "no yaml": (
        lambda f: (f / "mav0/cam0/sensor.yaml").write_text("%YAML:1.0\n- [\n"),
        r"cam0/sensor\.yaml: cannot be read",
    ),
}


@pytest.mark.parametrize("what", BAD)
def test_bad_input_is_named_in_one_line(folder: Path, what: str) -> None:
    damage, message = BAD[what]
    damage(folder)
    with pytest.raises(RecordingError, match=message) as raised:
        mav(folder)
    assert "\n" not in str(raised.value)


def test_it_is_not_the_ground_robots(folder: Path) -> None:
    with pytest.raises(RecordingError, match="no depth images"):
        open_robot(folder, Source.GROUND)


def test_a_folder_of_no_known_kind_says_what_would_be(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match=r"recording\.toml .* mav0/cam0 .* rgb\.txt"):
        open_robot(tmp_path, Source.MAV)


def test_numbers_may_be_written_without_a_point(folder: Path) -> None:
    """YAML 1.1 takes 2e-3 for text."""
    replace(folder, "imu0/sensor.yaml", r"2\.0000e-3", "2e-3")
    noise = mav(folder).calibration.imu
    assert noise is not None
    assert noise.accelerometer_noise_density == 2e-3

"""Numbers of calibrations and samples that no sensor has, and recordings without digests."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from airground.core.cloud import Source
from airground.core.messages import MagneticSamples
from airground.io.open_recording import open_robot
from airground.io.recording import Recording
from airground.io.sensor_file import read_imu_noise, read_positive
from tests.io.plain_folders import CAMERA_YAML, IMU_YAML, write_euroc
from tests.io.recordings import write_recording
from tests.io.test_hostile import edit, refused


@pytest.mark.parametrize(
    ("was", "by", "key"),
    [
        ("fx = 20.0", "fx = 1e-300", "camera.fx"),
        ("fy = 21.0", "fy = 1e7", "camera.fy"),
        ("rate_hz = 30.0", "rate_hz = 1e9", "camera.rate_hz"),
        ("time_offset_ns = 0", "time_offset_ns = 86400000000001", "camera.time_offset_ns"),
        ("time_offset_ns = 0", "time_offset_sigma_ns = 1e300\ntime_offset_ns = 0", "sigma_ns"),
        ("gyro_noise_density = 0.0001", "gyro_noise_density = 1e-300", "gyro_noise_density"),
        ("gyro_bias_walk = 1e-05", "gyro_bias_walk = 1e300", "gyro_bias_walk"),
        ("rate_hz = 200.0", "rate_hz = 200.0\naccelerometer_bias_sigma = 0.0", "imu.*bias_sigma"),
        ("noise_t = 1e-07", "noise_t = 5.0", "magnetometer.noise_t"),
        ("units_per_m = 5000.0", "units_per_m = 1e-300", "depth.units_per_m"),
        ("units_per_m = 5000.0", "units_per_m = 5000.0\nscale_sigma = 2.0", "depth.scale_sigma"),
        ("units_per_m = 5000.0", f"units_per_m = 5000.0\ndelay_ns = {2**62}", "depth.delay_ns"),
    ],
)
def test_a_calibration_out_of_range(tmp_path: Path, was: str, by: str, key: str) -> None:
    ours = write_recording(tmp_path / "ours")
    edit(ours / "recording.toml", re.escape(was), by)
    refused(lambda: Recording.open(ours), rf"recording\.toml: key 'calibration\..*{key}': Input")


@pytest.mark.parametrize("number", ["1.0e-300", "1.0e+300"])
def test_a_sensor_file_out_of_range(tmp_path: Path, number: str) -> None:
    file = tmp_path / "sensor.yaml"
    file.write_text(IMU_YAML.replace("1.9393e-05", number))
    refused(
        lambda: read_imu_noise(file), "key 'gyroscope_random_walk': expected a number from 1e-15"
    )
    file.write_text(f"{IMU_YAML}accelerometer_bias_sigma: {number}\n")
    refused(
        lambda: read_imu_noise(file), "key 'accelerometer_bias_sigma': expected a number from 1e-06"
    )
    file.write_text(f"depth_units_per_m: {number}\nrate_hz: {number}\n")
    for key in ("depth_units_per_m", "rate_hz"):
        refused(
            lambda key=key: read_positive(file, key), f"key '{key}': expected a number from 0.001"
        )
    euroc = write_euroc(tmp_path / "euroc")
    (euroc / "mav0/cam0/sensor.yaml").write_text(CAMERA_YAML.replace("39.03", number))
    refused(
        lambda: open_robot(euroc, Source.MAV), "key 'intrinsics': expected focal lengths from 1"
    )


@pytest.mark.parametrize("value", ["48.0", "-0.48", "1e300"])
def test_a_field_in_another_unit(tmp_path: Path, value: str) -> None:
    """Microtesla and gauss."""
    ours = write_recording(tmp_path / "ours")
    edit(ours / "ground/mag0/data.csv", r"(?m)^5000000,[^,]*", f"5000000,{value}")
    said = r"mag0/data\.csv: the magnetometer reads .* T at stamp 5000000; expected at most 0\.1"
    refused(lambda: Recording.open(ours), said)


@pytest.mark.parametrize("name", ["mav0/imu0/data.csv", "ground/depth", "mav0/mag0/data.csv"])
def test_a_recording_without_a_digest_is_not_verified(tmp_path: Path, name: str) -> None:
    ours = write_recording(tmp_path / "ours")
    Recording.open(ours).verify()
    edit(ours / "recording.toml", rf'(?m)^"?{re.escape(name)}"? = .*\n', "")
    refused(Recording.open(ours).verify, rf"key 'digests': that of '{name}' is missing")
    edit(ours / "recording.toml", r"(?ms)^\[digests\].*?(?=^\[|\Z)", "")
    edit(ours / "recording.toml", r"(?m)^duration_s", "digests = {}\nduration_s")
    refused(Recording.open(ours).verify, "key 'digests': that of 'mav0/cam0/data.csv' is missing")


@pytest.mark.parametrize("name", ["mav0/cam0/data.csv", "mav0/imu0/data.csv", "mav0/mag0/data.csv"])
def test_a_last_stamp_whose_step_overflows(tmp_path: Path, name: str) -> None:
    """The difference of the two is positive in 64 bits."""
    ours = write_recording(tmp_path / "ours")
    edit(ours / name, r"(?m)^\d+(?=,[^\n]*\n\Z)", str(-(2**63)))
    refused(lambda: Recording.open(ours), rf"{name}: stamp -{2**63} \(entry \d+\) follows")
    with pytest.raises(ValueError, match="must strictly increase"):
        MagneticSamples(np.array([1, 2, -(2**63)]), np.zeros((3, 3)))

"""Inertial sensors of plain folders, in EuRoC's form: `imu0/{sensor.yaml,data.csv}`."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from airground.core.messages import ImuNoise, ImuSamples
from airground.core.se3 import SE3
from airground.io.euroc import read_imu
from airground.io.plausibility import (
    IMU_STEP_S,
    check_imu_covers,
    check_stamp_unit,
    check_up_in_camera,
    upwards,
)
from airground.io.sensor_file import read_imu_noise, read_pose


@dataclass(frozen=True, eq=False)
class Inertial:
    """An IMU beside a camera.

    Attributes:
        samples: All of them.
        noise: As `sensor.yaml` says.
        T_imu_camera: The camera in the IMU.
        up_imu: (3,) what is up in the IMU as the recording starts.
    """

    samples: ImuSamples
    noise: ImuNoise
    T_imu_camera: SE3
    up_imu: NDArray[np.float64]


def read_inertial(
    folder: Path, T_body_camera: SE3, camera_stamps_ns: NDArray[np.int64]
) -> Inertial:
    """Read `imu0`, and check that it fits the images.

    Args:
        folder: `imu0`.
        T_body_camera: The camera in the body of `T_BS`.
        camera_stamps_ns: (N,) of the images.

    Raises:
        RecordingError: One line that names file, key or stamp and what would be right.
    """
    imu_file, sensor_file = folder / "data.csv", folder / "sensor.yaml"
    T_imu_camera = _in_imu(read_pose(sensor_file), T_body_camera)
    samples = read_imu(imu_file)
    check_stamp_unit(samples.stamps_ns, imu_file, "nanoseconds", IMU_STEP_S)
    check_imu_covers(samples, imu_file, camera_stamps_ns)
    up_imu = upwards(samples, imu_file)
    check_up_in_camera(T_imu_camera.rotation.T @ up_imu, imu_file)
    return Inertial(samples, read_imu_noise(sensor_file), T_imu_camera, up_imu)


def _in_imu(T_body_imu: SE3, T_body_camera: SE3) -> SE3:
    """Where the body is the IMU, the camera's pose stays as published to the last bit."""
    if (T_body_imu.matrix() == np.eye(4)).all():
        return T_body_camera
    return T_body_imu.inverse() @ T_body_camera

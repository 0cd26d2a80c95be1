"""The calibration of both robots' sensors as it stands in TOML files.

`recording.toml` holds the nominal calibration in these tables; a simulation keeps the true one
elsewhere, in the same form."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from pydantic import AfterValidator, BaseModel, ConfigDict, Field, model_validator

from airground.core.camera import PinholeCamera
from airground.core.messages import ImuNoise, RobotCalibration
from airground.core.se3 import ROTATION_TOLERANCE, SE3

Positive = Annotated[float, Field(gt=0)]
Row = tuple[float, float, float, float]
MAX_SIDE_PX = 8192
"""Largest side of an image [px]: images are decoded and undistorted whole."""


class Table(BaseModel):
    """A frozen table of a TOML file that refuses keys it does not know."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


def _rigid(rows: tuple[Row, Row, Row, Row]) -> tuple[Row, Row, Row, Row]:
    matrix = np.array(rows)
    off = float(np.abs(matrix[:3, :3] @ matrix[:3, :3].T - np.eye(3)).max())
    if off > ROTATION_TOLERANCE or np.linalg.det(matrix[:3, :3]) < 0:
        raise ValueError(f"the upper left 3x3 must be a rotation, it is off by {off:.1e}")
    if rows[3] != (0.0, 0.0, 0.0, 1.0):
        raise ValueError(f"the last row must be 0, 0, 0, 1, not {list(rows[3])}")
    return rows


Pose = Annotated[tuple[Row, Row, Row, Row], AfterValidator(_rigid)]
"""A rigid motion as four rows of a homogeneous matrix."""


def pose_rows(pose: SE3) -> Pose:
    """The rows that stand for `pose` in a file."""
    return tuple(tuple(float(v) for v in row) for row in pose.matrix())  # type: ignore[return-value]


class CameraTable(Table):
    """A pinhole camera; integer pixel coordinates are pixel centres."""

    width: Annotated[int, Field(ge=1, le=MAX_SIDE_PX)]
    height: Annotated[int, Field(ge=1, le=MAX_SIDE_PX)]
    fx: Positive
    fy: Positive
    cx: float
    cy: float
    rate_hz: Positive
    time_offset_ns: int
    """What to add to a stamp of the camera to get the time on the IMU's clock [ns]."""

    @model_validator(mode="after")
    def _principal_point_inside(self) -> CameraTable:
        if not (0 <= self.cx <= self.width - 1 and 0 <= self.cy <= self.height - 1):
            raise ValueError(
                f"principal point ({self.cx}, {self.cy}) lies outside the "
                f"{self.width}x{self.height} image"
            )
        return self

    def pinhole(self) -> PinholeCamera:
        return PinholeCamera(self.width, self.height, self.fx, self.fy, self.cx, self.cy)


class ImuTable(Table):
    """Rates and noise of an inertial sensor, as its data sheet says."""

    rate_hz: Positive
    gyro_noise_density: Positive
    """[rad/s/sqrt(Hz)]"""
    gyro_bias_walk: Positive
    """[rad/s^2/sqrt(Hz)]"""
    accelerometer_noise_density: Positive
    """[m/s^2/sqrt(Hz)]"""
    accelerometer_bias_walk: Positive
    """[m/s^3/sqrt(Hz)]"""

    def noise(self) -> ImuNoise:
        return ImuNoise(**self.model_dump(exclude={"rate_hz"}))


class MagnetometerTable(Table):
    """Rate and noise of a magnetometer, as its data sheet says."""

    rate_hz: Positive
    noise_t: Positive
    """Standard deviation of one sample per axis [T]."""


class DepthTable(Table):
    """How depth is written in 16-bit PNG files; 0 is missing."""

    units_per_m: Positive
    """PNG value of one metre of depth along the optical axis."""


class RobotTable(Table):
    """One robot's sensors and where they sit."""

    T_body_imu: Pose
    T_imu_camera: Pose
    camera: CameraTable
    imu: ImuTable
    magnetometer: MagnetometerTable

    def calibration(self) -> RobotCalibration:
        return RobotCalibration(
            camera=self.camera.pinhole(),
            T_imu_camera=SE3.from_matrix(self.T_imu_camera),
            T_body_imu=SE3.from_matrix(self.T_body_imu),
            imu=self.imu.noise(),
            camera_time_offset_ns=self.camera.time_offset_ns,
        )


class GroundTable(RobotTable):
    """The ground robot also has a depth camera, registered to the colour camera."""

    depth: DepthTable


class CalibrationTable(Table):
    """Both robots' sensors."""

    mav: RobotTable
    ground: GroundTable

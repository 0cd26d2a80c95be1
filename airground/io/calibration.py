"""The calibration of both robots' sensors as it stands in TOML files.

`recording.toml` holds the nominal calibration in these tables; a simulation keeps the true one
elsewhere, in the same form."""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated

import numpy as np
from pydantic import AfterValidator, BaseModel, ConfigDict, Field, model_validator

from airground.core.messages import CalibrationSigmas, ImuNoise, RobotCalibration
from airground.core.se3 import FARTHEST_M, ROTATION_TOLERANCE, SE3
from airground.io import calibration_ranges as ranges
from airground.io.lens import COEFFICIENTS, MAX_READOUT_S, Lens, Model, Undistortion
from airground.io.registration import Registration

Rate = Annotated[float, Field(ge=ranges.MIN_RATE_HZ, le=ranges.MAX_RATE_HZ)]
Focal = Annotated[float, Field(ge=ranges.MIN_FOCAL_PX, le=ranges.MAX_FOCAL_PX)]
Noise = Annotated[float, Field(ge=ranges.MIN_NOISE, le=ranges.MAX_NOISE)]
FieldNoise = Annotated[float, Field(ge=ranges.MIN_FIELD_NOISE_T, le=ranges.MAX_FIELD_NOISE_T)]
Units = Annotated[float, Field(ge=ranges.MIN_UNITS_PER_M, le=ranges.MAX_UNITS_PER_M)]
Offset = Annotated[int, Field(ge=-ranges.MAX_OFFSET_NS, le=ranges.MAX_OFFSET_NS)]
Row = tuple[float, float, float, float]
MAX_SIDE_PX = 8192
"""Largest side of an image [px]: images are decoded and undistorted whole."""


class Table(BaseModel):
    """A frozen table of a TOML file that refuses keys it does not know."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


def _rigid(rows: tuple[Row, Row, Row, Row]) -> tuple[Row, Row, Row, Row]:
    matrix = np.array(rows)
    if not (np.abs(matrix) < FARTHEST_M).all():
        raise ValueError(f"a length must be below {FARTHEST_M:g} m")
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


def _is_zero(value: float) -> bool:
    return value == 0


def _is_none(value: object) -> bool:
    return value is None


TurnSigma = Annotated[float | None, Field(ge=0, le=ranges.MAX_TURN_SIGMA_RAD, exclude_if=_is_none)]
BiasSigma = Annotated[
    float | None, Field(ge=ranges.MIN_BIAS_MPS2, le=ranges.MAX_BIAS_MPS2, exclude_if=_is_none)
]
OffsetSigma = Annotated[float | None, Field(ge=0, le=ranges.MAX_OFFSET_NS, exclude_if=_is_none)]
ScaleSigma = Annotated[float | None, Field(ge=0, le=ranges.MAX_SCALE_SIGMA, exclude_if=_is_none)]
"""Standard deviations; None where the file does not state them."""


def _or(stated: float | None, usual: float) -> float:
    return usual if stated is None else stated


class CameraTable(Table):
    """A camera; integer pixel coordinates are pixel centres.

    A file leaves out the keys of distortion for a pinhole camera, and `readout_s` for a global
    shutter."""

    width: Annotated[int, Field(ge=1, le=MAX_SIDE_PX)]
    height: Annotated[int, Field(ge=1, le=MAX_SIDE_PX)]
    fx: Focal
    fy: Focal
    cx: float
    cy: float
    rate_hz: Rate
    time_offset_ns: Offset
    """What to add to a stamp of the camera to get the time on the IMU's clock [ns]."""
    time_offset_sigma_ns: OffsetSigma = None
    """Standard deviation of that [ns]."""
    distortion_model: Annotated[Model | None, Field(exclude_if=_is_none)] = None
    distortion_coefficients: Annotated[
        tuple[float, ...], Field(exclude_if=lambda numbers: not numbers)
    ] = ()
    """In OpenCV's order; see `Lens`."""
    readout_s: Annotated[float, Field(ge=0, le=MAX_READOUT_S, exclude_if=_is_zero)] = 0.0
    """Time from the first to the last row of an image [s]; a stamp is that of the middle row."""

    @model_validator(mode="after")
    def _principal_point_inside(self) -> CameraTable:
        if not (0 <= self.cx <= self.width - 1 and 0 <= self.cy <= self.height - 1):
            raise ValueError(
                f"principal point ({self.cx}, {self.cy}) lies outside the "
                f"{self.width}x{self.height} image"
            )
        return self

    @model_validator(mode="after")
    def _lens_that_can_be(self) -> CameraTable:
        count, model = len(self.distortion_coefficients), self.distortion_model
        wanted = COEFFICIENTS[model] if model else (0,)
        if count not in wanted:
            numbers = " or ".join(map(str, wanted))
            raise ValueError(
                f"distortion_coefficients: expected {numbers} for {model or 'no distortion_model'}"
            )
        if self.lens().folds():
            raise ValueError("distortion_coefficients: the image would fold back within its pixels")
        return self

    def lens(self) -> Lens:
        """The camera with its distortion and shutter."""
        return Lens(
            self.width,
            self.height,
            (self.fx, self.fy, self.cx, self.cy),
            self.distortion_coefficients,
            self.distortion_model or "radial-tangential",
            self.readout_s,
        )


class ImuTable(Table):
    """Rates and noise of an inertial sensor, as its data sheet says."""

    rate_hz: Rate
    gyro_noise_density: Noise
    """[rad/s/sqrt(Hz)]"""
    gyro_bias_walk: Noise
    """[rad/s^2/sqrt(Hz)]"""
    accelerometer_noise_density: Noise
    """[m/s^2/sqrt(Hz)]"""
    accelerometer_bias_walk: Noise
    """[m/s^3/sqrt(Hz)]"""
    accelerometer_bias_sigma: BiasSigma = None
    """Standard deviation of the accelerometer's bias per axis at the start [m/s^2]."""

    def noise(self) -> ImuNoise:
        return ImuNoise(
            self.gyro_noise_density,
            self.gyro_bias_walk,
            self.accelerometer_noise_density,
            self.accelerometer_bias_walk,
            self.accelerometer_bias_sigma,
        )


class MagnetometerTable(Table):
    """Rate and noise of a magnetometer, as its data sheet says."""

    rate_hz: Rate
    noise_t: FieldNoise
    """Standard deviation of one sample per axis [T]."""


class DepthTable(Table):
    """How depth is written in 16-bit PNG files; 0 is missing.

    `camera` and `T_camera_depth` are left out where depth is registered to the colour camera: each
    pixel's depth is that of the colour image's pixel."""

    units_per_m: Units
    """PNG value of one metre of depth along the optical axis."""
    scale_sigma: ScaleSigma = None
    """Relative standard deviation of that."""
    delay_ns: Annotated[Offset, Field(exclude_if=_is_zero)] = 0
    """Time of a depth image minus that of the colour image with the same stamp [ns]."""
    T_camera_depth: Annotated[Pose | None, Field(exclude_if=_is_none)] = None
    """Pose of the depth camera in the colour camera."""
    camera: Annotated[CameraTable | None, Field(exclude_if=_is_none)] = None
    """The depth camera, which has the clock of the colour camera."""

    @model_validator(mode="after")
    def _camera_with_its_pose(self) -> DepthTable:
        if (self.camera is None) != (self.T_camera_depth is None):
            raise ValueError("camera and T_camera_depth come together, or neither does")
        return self


class RobotTable(Table):
    """One robot's sensors and where they sit."""

    T_body_imu: Pose
    T_imu_camera: Pose
    mounting_sigma_rad: TurnSigma = None
    """Standard deviation of the turn in `T_imu_camera`, per axis [rad]."""
    camera: CameraTable
    imu: ImuTable
    magnetometer: MagnetometerTable

    def calibration(self) -> RobotCalibration:
        """The sensors as stages see them: with undistorted images."""
        undistortion = Undistortion(self.camera.lens())
        return RobotCalibration(
            camera=undistortion.camera,
            T_imu_camera=SE3.from_matrix(self.T_imu_camera),
            T_body_imu=SE3.from_matrix(self.T_body_imu),
            imu=self.imu.noise(),
            camera_time_offset_ns=self.camera.time_offset_ns,
            readout_s=undistortion.readout_s,
            sigmas=self._sigmas(),
        )

    def _sigmas(self) -> CalibrationSigmas:
        """How well it is known, as far as it is stated."""
        usual = CalibrationSigmas()
        clock_ns = self.camera.time_offset_sigma_ns
        return replace(
            usual,
            mounting_rad=_or(self.mounting_sigma_rad, usual.mounting_rad),
            clock_s=usual.clock_s if clock_ns is None else clock_ns * 1e-9,
        )


class GroundTable(RobotTable):
    """The ground robot also has a depth camera."""

    depth: DepthTable

    def _sigmas(self) -> CalibrationSigmas:
        known = super()._sigmas()
        return replace(known, depth_scale=_or(self.depth.scale_sigma, known.depth_scale))

    def registration(self) -> Registration | None:
        """Moves depth to the pixels of the colour camera; None where it is registered."""
        camera, pose = self.depth.camera, self.depth.T_camera_depth
        if camera is None or pose is None:
            return None
        return Registration(camera.lens(), self.camera.lens(), SE3.from_matrix(pose))


class CalibrationTable(Table):
    """Both robots' sensors."""

    mav: RobotTable
    ground: GroundTable

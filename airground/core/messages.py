"""Sensor messages: one frozen type per message, stamped in integer nanoseconds."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from airground.core.arrays import F32, F64, I64, U8, freeze, freeze_stamps
from airground.core.camera import PinholeCamera
from airground.core.cloud import Source
from airground.core.se3 import SE3


@dataclass(frozen=True, eq=False)
class MavImage:
    """One image of the MAV's downward camera: (height, width) uint8, grey.
    `stamp_ns` is the middle of the exposure on the camera's clock [ns]."""

    stamp_ns: int
    image: U8

    def __post_init__(self) -> None:
        freeze(self, "image", (None, None), np.uint8)


@dataclass(frozen=True, eq=False)
class GroundImage:
    """One registered RGB-D frame of the ground robot.

    Attributes:
        stamp_ns: Middle of the exposure on the camera's clock [ns].
        colour: (height, width, 3) uint8 RGB.
        depth: (height, width) float32 [m], z along the optical axis, NaN where missing.
    """

    stamp_ns: int
    colour: U8
    depth: F32

    def __post_init__(self) -> None:
        freeze(self, "colour", (None, None, 3), np.uint8)
        freeze(self, "depth", self.colour.shape[:2], np.float32)


@dataclass(frozen=True, eq=False)
class ImuSamples:
    """A run of inertial measurements in the `imu` frame.

    Attributes:
        stamps_ns: (N,) int64, strictly increasing.
        gyro: (N, 3) float64 angular rates [rad/s].
        accelerometer: (N, 3) float64 specific forces [m/s^2], +9.81 upwards at rest.
    """

    stamps_ns: I64
    gyro: F64
    accelerometer: F64

    def __post_init__(self) -> None:
        freeze_stamps(self)
        for name in ("gyro", "accelerometer"):
            freeze(self, name, (len(self.stamps_ns), 3), np.float64)

    def between(self, start_ns: int, end_ns: int) -> ImuSamples:
        """The samples with start_ns < stamp <= end_ns."""
        lo, hi = np.searchsorted(self.stamps_ns, [start_ns, end_ns], side="right")
        return ImuSamples(self.stamps_ns[lo:hi], self.gyro[lo:hi], self.accelerometer[lo:hi])


@dataclass(frozen=True, eq=False)
class MagneticSamples:
    """Magnetometer measurements (N, 3) float64 [T] in the `imu` frame, stamps increasing."""

    stamps_ns: I64
    field: F64

    def __post_init__(self) -> None:
        freeze_stamps(self)
        freeze(self, "field", (len(self.stamps_ns), 3), np.float64)

    def between(self, start_ns: int, end_ns: int) -> MagneticSamples:
        """The samples with start_ns < stamp <= end_ns."""
        lo, hi = np.searchsorted(self.stamps_ns, [start_ns, end_ns], side="right")
        return MagneticSamples(self.stamps_ns[lo:hi], self.field[lo:hi])


BIAS_OF_DENSITY = 25.0
"""Where a calibration does not state it, the bias of an accelerometer is taken to be so many times
its noise density [1/sqrt(s)]: 0.05 m/s^2 in an ADIS16448, 0.1 m/s^2 in an MPU-6000 ..."""
USUAL_BIAS_MPS2 = 0.1
"""... and at least this [m/s^2]: that of EuRoC's ADIS16448 is (-0.03, 0.14, 0.08) by its ground
truth."""


@dataclass(frozen=True)
class ImuNoise:
    """Noise of an inertial sensor by its data sheet.

    Attributes:
        gyro_noise_density: White noise [rad/s/sqrt(Hz)].
        gyro_bias_walk: Random walk of the bias [rad/s^2/sqrt(Hz)].
        accelerometer_noise_density: White noise [m/s^2/sqrt(Hz)].
        accelerometer_bias_walk: Random walk of the bias [m/s^3/sqrt(Hz)].
        stated_bias_sigma: Standard deviation of the accelerometer's bias per axis at the start
            [m/s^2]; None where nothing states it.
    """

    gyro_noise_density: float
    gyro_bias_walk: float
    accelerometer_noise_density: float
    accelerometer_bias_walk: float
    stated_bias_sigma: float | None = None

    @property
    def accelerometer_bias_sigma(self) -> float:
        """Standard deviation of the accelerometer's bias per axis at the start [m/s^2]."""
        if self.stated_bias_sigma is not None:
            return self.stated_bias_sigma
        return max(USUAL_BIAS_MPS2, BIAS_OF_DENSITY * self.accelerometer_noise_density)


@dataclass(frozen=True)
class CalibrationSigmas:
    """How well a calibration is known: standard deviations of its errors. The defaults are those
    of a careful calibration.

    Attributes:
        mounting_rad: Of the camera's turn against the IMU, per axis [rad].
        clock_s: Of the camera's clock against the IMU's [s].
        depth_scale: Relative, of measured depth.
    """

    mounting_rad: float = float(np.deg2rad(0.1))
    clock_s: float = 1e-3
    depth_scale: float = 3e-3


@dataclass(frozen=True)
class RobotCalibration:
    """Nominal calibration of one robot's sensors, with the errors of a real calibration.

    Attributes:
        camera: Intrinsics of the camera.
        T_imu_camera: Pose of the camera in the IMU's frame.
        T_body_imu: Pose of the IMU in the robot's body (x forward, z up).
        imu: Noise of the inertial sensor; None where the robot has none, or no gyro.
        camera_time_offset_ns: Time on the IMU's clock minus the camera's stamp [ns].
        readout_s: Time from the first to the last row of an image [s]; 0 for a global shutter.
        sigmas: How well all this is known.
    """

    camera: PinholeCamera
    T_imu_camera: SE3
    T_body_imu: SE3
    imu: ImuNoise | None = None
    camera_time_offset_ns: int = 0
    readout_s: float = 0.0
    sigmas: CalibrationSigmas = CalibrationSigmas()

    @property
    def accelerometer_bias_sigma(self) -> float:
        """That of the IMU, or a usual one where there is none [m/s^2]."""
        return USUAL_BIAS_MPS2 if self.imu is None else self.imu.accelerometer_bias_sigma


Message = MavImage | GroundImage | ImuSamples | MagneticSamples


@dataclass(frozen=True)
class Stamped:
    """A message and the robot that sent it; its time is that of its newest measurement."""

    robot: Source
    message: Message

"""How good the robots' sensors are: perfect, as in life, three times worse, as in 2013, or with
the lenses and shutters of consumer cameras."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from airground.errors import InputError
from airground.io.lens import KINECT_READOUT_S
from sim.sensors.auto_exposure import CONSUMER_EXPOSURE, RESPONSE_709, AutoExposure
from sim.sensors.faults import Fault
from sim.sensors.optics import PINHOLE, Optics
from sim.sensors.sensor_errors import (
    CalibrationErrors,
    DepthNoise,
    ImageNoise,
    ImuNoise,
    MagneticNoise,
)

CAMERA_RATE_HZ = 30.0
"""Rate of both cameras, of which a preset may keep every n-th image."""


@dataclass(frozen=True)
class SensorPreset:
    """All sensors of both robots; None is a perfect one.

    Attributes:
        mav_optics, ground_optics: Lens and shutter of the MAV's and the ground robot's camera.
        depth_delay_ns: Time from a colour image to the depth image with its stamp [ns].
        depth_baseline_m: Distance of the depth camera, to the left of the colour camera [m]; 0 is
            depth measured in the colour camera's own pixels.
        depth_registered: Whether the driver moves depth to the colour camera's pixels, by the
            nominal calibration; if not, depth is stored as it is measured. Without a baseline it
            makes no difference.
        faults: Failures of single sensors, for a while.
        exposure: Automatic exposure of both cameras; None for a fixed one.
        every: The recorded images: every n-th one of `CAMERA_RATE_HZ`.

    Raises:
        InputError: Automatic exposure of cameras that are perfect, or take no time.
    """

    name: str
    image: ImageNoise | None
    depth: DepthNoise | None
    imu: ImuNoise | None
    magnetic: MagneticNoise | None
    calibration: CalibrationErrors | None
    mav_optics: Optics = PINHOLE
    ground_optics: Optics = PINHOLE
    depth_delay_ns: int = 0
    depth_baseline_m: float = 0.0
    depth_registered: bool = True
    faults: tuple[Fault, ...] = ()
    exposure: AutoExposure | None = None
    every: int = 1

    @property
    def camera_hz(self) -> float:
        """Rate of the recorded images of both cameras [Hz]."""
        return CAMERA_RATE_HZ / self.every

    def __post_init__(self) -> None:
        if self.exposure is not None and (self.image is None or self.image.exposure_s <= 0):
            raise InputError(
                f"sensors '{self.name}' cannot have automatic exposure: images are perfect"
            )


# ADIS16448 as in EuRoC's sensor.yaml; the biases are those of a few minutes after turn-on.
ADIS16448 = ImuNoise(
    gyro_density=1.6968e-4,
    gyro_walk=1.9393e-5,
    gyro_bias=5e-3,
    accelerometer_density=2.0e-3,
    accelerometer_walk=3.0e-3,
    accelerometer_bias=5e-2,
)

# MPU-6000 (InvenSense PS-MPU-6000A, rev. 3.4, 2013): 0.005 deg/s/sqrt(Hz), 400 ug/sqrt(Hz).
# Biases by its changes with temperature: the gyro's (40 deg/s over 125 K) 1 K after it was zeroed,
# the accelerometer's (70 mg over 70 K) 10 K from where it was calibrated. It states no random
# walks: those of EuRoC's IMU.
MPU6000 = ImuNoise(
    gyro_density=8.73e-5,
    gyro_walk=ADIS16448.gyro_walk,
    gyro_bias=5e-3,
    accelerometer_density=3.92e-3,
    accelerometer_walk=ADIS16448.accelerometer_walk,
    accelerometer_bias=0.1,
)

NONE = SensorPreset("none", None, None, None, None, None)

# 2 grey levels of noise at mid grey.
_NOMINAL_IMAGE = ImageNoise(1.0, 0.0235, 0.20, 0.03, 0.005)

NOMINAL = SensorPreset(
    "nominal",
    image=_NOMINAL_IMAGE,
    depth=DepthNoise(1.0, 0.8, 1 / 8, 82.0, 2.0, (0.5, 5.0)),
    imu=ADIS16448,
    magnetic=MagneticNoise(0.2e-6, 0.3e-6, 0.6),
    calibration=CalibrationErrors(1e-3, np.deg2rad(0.1), 1_000_000, 3e-3, 5e-3),
)

HARSH = SensorPreset(
    "harsh",
    image=ImageNoise(2.0, 0.094, 0.35, 0.10, 0.015),
    depth=DepthNoise(1.5, 1.2, 1 / 8, 77.0, 4.0, (0.5, 4.5)),
    imu=ADIS16448.scaled(3),
    magnetic=MagneticNoise(0.6e-6, 1.1e-6, 1.8),
    calibration=CalibrationErrors(3e-3, np.deg2rad(0.3), 3_000_000, 9e-3, 1.5e-2),
)

PAPER = SensorPreset(
    "paper",
    # A global shutter of 752 x 480 (MT9V034) indoors: 10 ms at twice the gain of NOMINAL.
    image=ImageNoise(1.4, 0.047, 0.20, 0.03, 0.010),
    # The Kinect of the published model.
    depth=DepthNoise(1.0, 0.8, 1 / 8, 82.0, 2.0, (0.5, 5.0)),
    imu=MPU6000,
    magnetic=MagneticNoise(0.2e-6, 0.3e-6, 0.6),
    # Focal length: repeated checkerboard calibrations differ by 1 to 2 per mille. Mounting and
    # clock: adjusted by hand, and software stamps over USB. Depth: as it comes, with the mean of
    # the corrections of the TUM RGB-D benchmark's three cameras (3.5, 3.1 and 0 %).
    calibration=CalibrationErrors(2e-3, np.deg2rad(0.3), 3_000_000, 2.2e-2, 1e-2),
)
"""Sensors of 2013: consumer parts, calibrated with the tools of the time."""

REAL = replace(
    NOMINAL,
    name="real",
    image=replace(_NOMINAL_IMAGE, gamma=RESPONSE_709),
    exposure=CONSUMER_EXPOSURE,
    # 480 rows, one each 30 us.
    mav_optics=Optics("radtan", readout_s=0.0144),
    ground_optics=Optics("radtan", readout_s=KINECT_READOUT_S),
    # The two cameras of a Kinect have no common trigger: half of a period of 30 Hz at most.
    depth_delay_ns=10_000_000,
    depth_baseline_m=0.025,
)
"""The noise of `nominal`, with the lenses, rolling shutters and exposure of consumer cameras, and a
Kinect of two cameras."""

PRESETS = {preset.name: preset for preset in (NONE, NOMINAL, HARSH, PAPER, REAL)}


def sensor_preset(name: str) -> SensorPreset:
    """The preset of this name; InputError lists the known ones."""
    if name not in PRESETS:
        raise InputError(f"unknown sensor preset '{name}': known are {', '.join(PRESETS)}")
    return PRESETS[name]

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
from sim.world.magnetic_field import EARTH_FIELD_WORLD


@dataclass(frozen=True)
class ImageNoise:
    """What a camera does to a picture.

    Attributes:
        read_noise: Deviation of a black pixel [grey levels].
        shot_noise: Variance added per grey level of light [grey levels].
        vignetting: Share of the light that is lost in the corners.
        exposure_drift: Deviation of the logarithm of the gain, over seconds.
        exposure_s: Exposure time [s]; with automatic exposure the one that shows light as it is.
        gamma: A grey level is white times light to the power of 1 / gamma, beside the 2.2 that
            pictures have already.
    """

    read_noise: float
    shot_noise: float
    vignetting: float
    exposure_drift: float
    exposure_s: float
    gamma: float = 1.0


@dataclass(frozen=True)
class DepthNoise:
    """What a Kinect does to depth (Nguyen, Izadi and Lovell, 3DIMPVT 2012).

    Attributes:
        axial_scale: Times the published axial deviation.
        lateral_px: Deviation of a silhouette's place, on a surface seen head-on [px].
        disparity_step_px: Disparity is rounded to this [px].
        grazing_limit_deg: Angle of incidence at which half of a surface is missing [deg].
        grazing_spread_deg: Width of the transition at that limit [deg].
        range_m: Nearest and farthest depth [m].
    """

    axial_scale: float
    lateral_px: float
    disparity_step_px: float
    grazing_limit_deg: float
    grazing_spread_deg: float
    range_m: tuple[float, float]


@dataclass(frozen=True)
class ImuNoise:
    """White noise, bias and its random walk.

    Attributes:
        gyro_density: Noise density of the gyro [rad/s/sqrt(Hz)].
        gyro_walk: Random walk of the gyro's bias [rad/s^2/sqrt(Hz)].
        gyro_bias: Deviation of the bias at the start [rad/s].
        accelerometer_density: Noise density of the accelerometer [m/s^2/sqrt(Hz)].
        accelerometer_walk: Random walk of the accelerometer's bias [m/s^3/sqrt(Hz)].
        accelerometer_bias: Deviation of the bias at the start [m/s^2].
    """

    gyro_density: float
    gyro_walk: float
    gyro_bias: float
    accelerometer_density: float
    accelerometer_walk: float
    accelerometer_bias: float

    def scaled(self, factor: float) -> ImuNoise:
        return ImuNoise(**{name: factor * value for name, value in vars(self).items()})


@dataclass(frozen=True)
class MagneticNoise:
    """What disturbs a magnetometer.

    Attributes:
        noise_t: White noise of one sample per axis [T].
        hard_iron_t: Deviation of what the robot's own calibration leaves, per axis [T].
        anomaly_scale: Times the anomaly that iron in the building makes.
    """

    noise_t: float
    hard_iron_t: float
    anomaly_scale: float


@dataclass(frozen=True)
class CalibrationErrors:
    """Size of the difference between nominal and true calibration.

    Signs and directions are drawn by the seed.

    Attributes:
        focal: Relative error of the focal lengths.
        camera_to_imu: Angle by which the mounting is off [rad].
        time_offset_ns: Camera's clock against the IMU's [ns].
        depth_scale: Relative error of the depth camera's scale.
        distortion: Relative error of a lens's coefficients.
    """

    focal: float
    camera_to_imu: float
    time_offset_ns: int
    depth_scale: float
    distortion: float = 0.0


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


def with_noise(preset: SensorPreset, factor: float) -> SensorPreset:
    """The preset with `factor` times the noise of images, depth and inertial sensors.

    What is no noise stays: the optics, steps of disparity, limits of depth, the magnetometers
    and the errors of the calibration.
    """
    image, depth, imu = preset.image, preset.depth, preset.imu
    return replace(
        preset,
        image=image
        and replace(
            image,
            read_noise=factor * image.read_noise,
            shot_noise=factor**2 * image.shot_noise,  # a variance
        ),
        depth=depth
        and replace(
            depth, axial_scale=factor * depth.axial_scale, lateral_px=factor * depth.lateral_px
        ),
        imu=imu and imu.scaled(factor),
    )


def with_readout(preset: SensorPreset, readout_s: float) -> SensorPreset:
    """The preset with rolling shutters of this readout time [s]; 0 for global ones."""
    return replace(
        preset,
        mav_optics=replace(preset.mav_optics, readout_s=readout_s),
        ground_optics=replace(preset.ground_optics, readout_s=readout_s),
    )


def with_depth_camera(preset: SensorPreset, **change: float | bool) -> SensorPreset:
    """The preset with another `depth_baseline_m` or `depth_registered`."""
    return replace(preset, **change)  # type: ignore[arg-type]


def with_distortion(preset: SensorPreset, factor: float) -> SensorPreset:
    """The preset with radial-tangential lenses of `factor` times the measured distortion."""
    return replace(
        preset,
        mav_optics=replace(preset.mav_optics, lens="radtan", distortion=factor),
        ground_optics=replace(preset.ground_optics, lens="radtan", distortion=factor),
    )


def with_auto_exposure(preset: SensorPreset, strength: float) -> SensorPreset:
    """The preset with automatic exposure that makes this share of the corrections, in stops, that
    `real` makes; 0 is a fixed exposure."""
    exposure = replace(CONSUMER_EXPOSURE, strength=strength) if strength > 0 else None
    return replace(preset, exposure=exposure)


def with_gamma(preset: SensorPreset, gamma: float) -> SensorPreset:
    """The preset with this gamma of both cameras; InputError if their images are perfect."""
    if preset.image is None:
        if gamma == 1:
            return preset
        raise InputError(f"sensors '{preset.name}' cannot have a gamma: images are perfect")
    return replace(preset, image=replace(preset.image, gamma=gamma))


def with_dropped(preset: SensorPreset, seconds: float) -> SensorPreset:
    """The preset with cameras that both drop their images for so long [s], each at a time drawn by
    the seed."""
    return _with_faults(
        preset, Fault("dropped", "mav", seconds), Fault("dropped", "ground", seconds)
    )


def with_imu_gap(preset: SensorPreset, seconds: float) -> SensorPreset:
    """The preset with IMUs that both miss their samples for so long [s], each at a time drawn by
    the seed."""
    return _with_faults(
        preset, Fault("imu_gap", "mav", seconds), Fault("imu_gap", "ground", seconds)
    )


def _with_faults(preset: SensorPreset, *faults: Fault) -> SensorPreset:
    lasting = tuple(fault for fault in faults if fault.duration_s > 0)
    return replace(preset, faults=(*preset.faults, *lasting))


def with_fisheye(preset: SensorPreset, factor: float) -> SensorPreset:
    """The preset with fisheyes of 150 deg of `factor` times the measured distortion; 0 is an
    ideal equidistant lens."""
    return replace(
        preset,
        mav_optics=replace(preset.mav_optics, lens="equidistant", distortion=factor),
        ground_optics=replace(preset.ground_optics, lens="equidistant", distortion=factor),
    )


def with_heading_error(preset: SensorPreset, deviation_deg: float) -> SensorPreset:
    """The preset with headings of each robot's magnetometer that are off by this deviation.

    All of it is hard iron, which turns with the robot; the room's own anomaly is left out, so
    that the error is what is asked for.
    """
    horizontal_t = float(np.hypot(*EARTH_FIELD_WORLD[:2]))
    noise_t = preset.magnetic.noise_t if preset.magnetic else 0.0
    iron_t = horizontal_t * float(np.tan(np.deg2rad(deviation_deg)))
    return replace(preset, magnetic=MagneticNoise(noise_t, iron_t, 0.0))

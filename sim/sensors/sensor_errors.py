"""How large the errors of one sensor are: noise, drift, limits, calibration."""

from __future__ import annotations

from dataclasses import dataclass


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

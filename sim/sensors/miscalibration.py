"""True and nominal calibration of the sensors, which differ slightly."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from airground.core.se3 import SE3
from airground.io.calibration import (
    CalibrationTable,
    CameraTable,
    DepthTable,
    GroundTable,
    ImuTable,
    MagnetometerTable,
    RobotTable,
    pose_rows,
)
from airground.io.calibration_ranges import MIN_BIAS_MPS2
from sim.robots.robot_motion import Mounting
from sim.sensors.depth import INFRARED_FOCAL_PX
from sim.sensors.optics import EUROC_RADTAN, KINECT_RADTAN, misjudged
from sim.sensors.presets import ADIS16448, NOMINAL, SensorPreset
from sim.sensors.sensor_errors import CalibrationErrors, ImuNoise

IMU_RATE_HZ = 200.0
MAGNETOMETER_RATE_HZ = 50.0
MAV_IMAGE_PX = (752, 480)
GROUND_IMAGE_PX = (640, 480)
GROUND_FOCAL_PX = 525.0
DEPTH_UNITS_PER_M = 5000.0


@dataclass(frozen=True)
class Calibrations:
    """True calibration of the sensors, and the nominal one that the recording states.

    `driver` is the nominal one by which the Kinect's driver registers depth, which the recording
    does not need to state then; None where it does not."""

    true: CalibrationTable
    nominal: CalibrationTable
    driver: GroundTable | None = None


def calibrate(
    mav_focal_px: float,
    mav: Mounting,
    ground: Mounting,
    preset: SensorPreset,
    rng: np.random.Generator,
) -> Calibrations:
    """Draw the errors of a preset.

    The cameras are as in the scene and the preset, with another nominal focal length, distortion
    and mounting; clocks and depth scale have their design values nominally, and other true values.
    The nominal calibration states how large the errors are, as a laboratory's would.

    Args:
        mav_focal_px: True focal length of the MAV's camera [px].
        mav, ground: True places of the sensors.
        preset: Sensor preset with the size of the errors, and the noise of the data sheets.
        rng: Source of signs and directions.
    """
    errors = preset.calibration or CalibrationErrors(0.0, 0.0, 0, 0.0)
    signs = rng.choice([-1.0, 1.0], 5)
    axes = rng.standard_normal((2, 3))
    bent = rng.choice([-1.0, 1.0], 2)
    imu, magnetometer = _imu_table(preset.imu), _magnetometer_table(preset)
    lenses = (
        preset.mav_optics.applied_to(
            _camera(MAV_IMAGE_PX, mav_focal_px, preset.camera_hz), EUROC_RADTAN
        ),
        preset.ground_optics.applied_to(
            _camera(GROUND_IMAGE_PX, GROUND_FOCAL_PX, preset.camera_hz), KINECT_RADTAN
        ),
    )
    tables = []
    for number, (mounting, lens) in enumerate(zip((mav, ground), lenses, strict=True)):
        focal, clock = signs[2 * number : 2 * number + 2]
        offset_ns = int(clock * errors.time_offset_ns)
        true_camera = lens.model_copy(update={"time_offset_ns": offset_ns})
        nominal_camera = misjudged(
            lens, 1 + focal * errors.focal, 1 + bent[number] * errors.distortion
        )
        axis = axes[number]
        turn = SE3.from_rotation_vector(errors.camera_to_imu * axis / np.linalg.norm(axis))
        true, nominal = (
            RobotTable(
                T_body_imu=pose_rows(mounting.T_body_imu),
                T_imu_camera=pose_rows(T_imu_camera),
                camera=camera,
                imu=imu,
                magnetometer=magnetometer,
            )
            for T_imu_camera, camera in (
                (mounting.T_imu_camera, true_camera),
                (mounting.T_imu_camera @ turn, nominal_camera),
            )
        )
        tables.append((true, nominal))
    (mav_true, mav_nominal), (ground_true, ground_nominal) = tables
    if preset.calibration is not None:
        mav_nominal, ground_nominal = (
            _stating(errors, preset.imu, table) for table in (mav_nominal, ground_nominal)
        )
    scale = 1 + signs[4] * errors.depth_scale
    depth_true, registered, measured = _depth_tables(preset, ground_true.camera, scale, errors, rng)
    driven = preset.depth_baseline_m > 0 and preset.depth_registered
    stated = registered if driven else measured
    return Calibrations(
        CalibrationTable(mav=mav_true, ground=GroundTable(**dict(ground_true), depth=depth_true)),
        CalibrationTable(mav=mav_nominal, ground=GroundTable(**dict(ground_nominal), depth=stated)),
        GroundTable(**dict(ground_nominal), depth=measured) if driven else None,
    )


def _stating(errors: CalibrationErrors, noise: ImuNoise | None, nominal: RobotTable) -> RobotTable:
    """The nominal calibration with the standard deviations of its errors."""
    imu = nominal.imu
    if noise is not None:
        bias = max(noise.accelerometer_bias, MIN_BIAS_MPS2)
        imu = imu.model_copy(update={"accelerometer_bias_sigma": bias})
    camera = nominal.camera.model_copy(update={"time_offset_sigma_ns": errors.time_offset_ns})
    # Of a turn by one angle about any axis.
    per_axis = float(errors.camera_to_imu / np.sqrt(3))
    stated = {"mounting_sigma_rad": per_axis, "camera": camera, "imu": imu}
    return nominal.model_copy(update=stated)


def _depth_tables(
    preset: SensorPreset,
    colour: CameraTable,
    scale: float,
    errors: CalibrationErrors,
    rng: np.random.Generator,
) -> tuple[DepthTable, DepthTable, DepthTable]:
    """True depth as measured; nominal depth as registered to the colour camera, and as measured."""
    delay_ns = preset.depth_delay_ns
    true = DepthTable(units_per_m=DEPTH_UNITS_PER_M * scale, delay_ns=delay_ns)
    stated = None if preset.calibration is None else errors.depth_scale
    registered = DepthTable(units_per_m=DEPTH_UNITS_PER_M, scale_sigma=stated, delay_ns=delay_ns)
    if preset.depth_baseline_m <= 0:
        return true, registered, registered
    cameras = _depth_cameras(preset, colour, errors, rng)
    true, measured = (
        DepthTable(**dict(table) | camera)
        for table, camera in zip((true, registered), cameras, strict=True)
    )
    return true, registered, measured


def _depth_cameras(
    preset: SensorPreset, colour: CameraTable, errors: CalibrationErrors, rng: np.random.Generator
) -> tuple[dict[str, Any], dict[str, Any]]:
    """True and nominal camera and pose of a depth camera of its own. Its rows are read as those of
    the colour camera are, and by the same clock; its lens has no distortion."""
    sign, axis = rng.choice([-1.0, 1.0]), rng.standard_normal(3)
    shutter = {"readout_s": colour.readout_s, "time_offset_ns": colour.time_offset_ns}
    true = _camera(GROUND_IMAGE_PX, INFRARED_FOCAL_PX, colour.rate_hz).model_copy(update=shutter)
    nominal = misjudged(true, 1 + sign * errors.focal, 1.0)
    T_camera_depth = SE3(np.eye(3), np.array([-preset.depth_baseline_m, 0.0, 0.0]))
    turn = SE3.from_rotation_vector(errors.camera_to_imu * axis / np.linalg.norm(axis))
    return (
        {"camera": true, "T_camera_depth": pose_rows(T_camera_depth)},
        {"camera": nominal, "T_camera_depth": pose_rows(T_camera_depth @ turn)},
    )


def _camera(size: tuple[int, int], focal_px: float, rate_hz: float) -> CameraTable:
    """A pinhole camera of the design."""
    width, height = size
    return CameraTable(
        width=width,
        height=height,
        fx=focal_px,
        fy=focal_px,
        cx=(width - 1) / 2,
        cy=(height - 1) / 2,
        rate_hz=rate_hz,
        time_offset_ns=0,
    )


def _imu_table(noise: ImuNoise | None) -> ImuTable:
    """The nominal noise of a perfect sensor is that of a usual one: filters need some noise."""
    noise = noise or ADIS16448
    return ImuTable(
        rate_hz=IMU_RATE_HZ,
        gyro_noise_density=noise.gyro_density,
        gyro_bias_walk=noise.gyro_walk,
        accelerometer_noise_density=noise.accelerometer_density,
        accelerometer_bias_walk=noise.accelerometer_walk,
    )


def _magnetometer_table(preset: SensorPreset) -> MagnetometerTable:
    noise = preset.magnetic or NOMINAL.magnetic
    assert noise is not None
    return MagnetometerTable(rate_hz=MAGNETOMETER_RATE_HZ, noise_t=noise.noise_t)

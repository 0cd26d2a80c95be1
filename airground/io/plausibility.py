"""Checks of sensor data from any source: units, cover, gravity, rigid poses.

Every error is one line that names the file, what is wrong and what would be right."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from airground.core.arrays import F64, I64
from airground.core.messages import ImuSamples, MagneticSamples
from airground.core.se3 import FARTHEST_M, SE3, nearest_rotation
from airground.errors import RecordingError

CAMERA_STEP_S = (1e-3, 10.0)
"""Images come between 1000 times a second and every ten seconds [s]."""
IMU_STEP_S = (5e-5, 0.1)
"""Inertial samples come between 20000 and 10 times a second [s]."""
IMU_SLACK_S = 0.05
"""The IMU may begin this much after the first image, or end before the last [s]."""
GRAVITY_RANGE = (7.8, 12.0)
"""Median length of what an accelerometer reads on a robot [m/s^2]."""
MAX_GYRO = 100.0
"""Largest rate that gyros of robots measure: 4000 deg/s are 70 [rad/s]."""
MAX_ACCELERATION = 4000.0
"""Largest specific force that accelerometers for shocks measure: 400 g [m/s^2]."""
MAX_FIELD = 0.1
"""Largest field that reaches a robot's magnetometer, a magnet touching it [T]; in microtesla or
gauss the Earth's alone is more."""
START_S = 1.0
"""Over this time the accelerometer is averaged to find what is up [s]."""
RIGID_TOLERANCE = 1e-4
"""Published poses are rounded; beyond this they are wrong."""
ROUNDING = 1e-14
"""Products of a rotation's numbers are off by this at most."""
UPSIDE_DOWN = -0.3
"""Cosine below which "up" is on the wrong side; a right one is above 0.5, a flipped below -0.5."""

_UNITS_NS = {"nanoseconds": 1, "microseconds": 10**3, "milliseconds": 10**6, "seconds": 10**9}


def check_stamp_unit(stamps_ns: I64, path: Path, unit: str, steps_s: tuple[float, float]) -> None:
    """RecordingError if the stamps tick as if they were written in another unit than `unit`.

    Args:
        stamps_ns: (N,) stamps of the file at `path`, read as if it were in `unit` [ns].
        path: The file, for the message.
        unit: "nanoseconds" or "seconds": what the format prescribes.
        steps_s: Shortest and longest step that the sensor can have [s].
    """
    if len(stamps_ns) < 2:
        return
    step_s = float(np.median(np.diff(stamps_ns))) / 1e9
    low, high = steps_s
    if low <= step_s <= high:
        return
    # A step in true seconds is what was read, times true unit over the unit assumed.
    fits = [
        name
        for name, size in _UNITS_NS.items()
        if low <= step_s * size / _UNITS_NS[unit] <= high and name != unit
    ]
    guess = f"; they look like {fits[0]}" if fits else ""
    raise RecordingError(
        f"{path}: the stamps step by {step_s:.3g} s if they are {unit}{guess}; "
        f"expected {unit}, {low:g} to {high:g} s apart"
    )


def check_imu_covers(
    imu: ImuSamples, imu_path: Path, camera_stamps_ns: I64, offset_ns: int = 0
) -> None:
    """RecordingError unless inertial samples reach from the first image to the last.
    `offset_ns` leads from the camera's clock to the IMU's [ns]."""
    first, last = int(camera_stamps_ns[0]) + offset_ns, int(camera_stamps_ns[-1]) + offset_ns
    late_s = (int(imu.stamps_ns[0]) - first) / 1e9
    early_s = (last - int(imu.stamps_ns[-1])) / 1e9
    for missing_s, where in ((late_s, "begins"), (early_s, "ends")):
        if missing_s > IMU_SLACK_S:
            side = "after the first" if where == "begins" else "before the last"
            raise RecordingError(
                f"{imu_path}: the IMU does not cover the images: it {where} {missing_s:.3g} s "
                f"{side} image; samples must reach from the first image to the last"
            )


def upwards(imu: ImuSamples, imu_path: Path) -> F64:
    """(3,) unit vector that points up in the IMU as the recording starts.
    RecordingError if the accelerometer does not read gravity in m/s^2, or a sample is beyond what
    IMUs measure."""
    stamps, gyro, force = imu.stamps_ns, imu.gyro, imu.accelerometer
    _check_range(gyro, MAX_GYRO, "gyro reads {:.3g} rad/s", stamps, imu_path)
    _check_range(force, MAX_ACCELERATION, "accelerometer reads {:.3g} m/s^2", stamps, imu_path)
    usual = float(np.median(np.linalg.norm(imu.accelerometer, axis=1)))
    low, high = GRAVITY_RANGE
    if not low <= usual <= high:
        raise RecordingError(
            f"{imu_path}: the accelerometer reads {usual:.3g} m/s^2 (median length); "
            "expected about 9.81, in m/s^2 and gravity included"
        )
    start = imu.stamps_ns <= imu.stamps_ns[0] + round(START_S * 1e9)
    mean = imu.accelerometer[start].mean(axis=0)
    result: F64 = mean / np.linalg.norm(mean)
    return result


def check_field(samples: MagneticSamples, path: Path) -> None:
    """RecordingError if a magnetometer reads more than a field in tesla can be."""
    reads = "magnetometer reads {:.3g} T"
    _check_range(samples.field, MAX_FIELD, reads, samples.stamps_ns, path, ", the Earth's is 5e-05")


def _check_range(
    values: F64, limit: float, reads: str, stamps_ns: I64, path: Path, usual: str = ""
) -> None:
    beyond = (np.abs(values) > limit).any(axis=1)
    if beyond.any():
        index = int(np.argmax(beyond))
        said = reads.format(float(np.abs(values[index]).max()))
        raise RecordingError(
            f"{path}: the {said} at stamp {stamps_ns[index]}; expected at most {limit:g}{usual}"
        )


def check_up_in_camera(up_camera: F64, imu_path: Path) -> None:
    """RecordingError if gravity has the wrong sign for a camera that looks ahead or down.
    For any pitch between the two, up in the camera is within 45 degrees of (0, -1, -1)."""
    cosine = float(up_camera @ np.array([0.0, -1.0, -1.0])) / np.sqrt(2.0)
    if cosine < UPSIDE_DOWN:
        raise RecordingError(
            f"{imu_path}: gravity has the wrong sign, or T_BS is wrong: the camera would be "
            "upside down; at rest an accelerometer reads +9.81 m/s^2 upwards"
        )


def check_up_in_body(up_body: F64, imu_path: Path) -> None:
    """RecordingError if gravity has the wrong sign for a body whose z axis points up."""
    if up_body[2] < UPSIDE_DOWN:
        raise RecordingError(
            f"{imu_path}: gravity has the wrong sign, or T_body_imu is wrong: the robot would "
            "be upside down; at rest an accelerometer reads +9.81 m/s^2 upwards"
        )


def rigid(numbers: ArrayLike, path: Path, key: str, tolerance: float = RIGID_TOLERANCE) -> SE3:
    """A pose from 16 numbers, row by row; RecordingError where they are no rigid motion.
    `tolerance` is how far R R^T may differ from I."""
    matrix = np.asarray(numbers, np.float64)
    if matrix.size != 16:
        raise RecordingError(f"{path}: key '{key}': expected 16 numbers, got {matrix.size}")
    matrix = matrix.reshape(4, 4)
    rotation = matrix[:3, :3]
    if not (np.abs(matrix) < FARTHEST_M).all() or not (matrix[3] == (0, 0, 0, 1)).all():
        raise RecordingError(f"{path}: key '{key}': expected finite rows and a last of 0, 0, 0, 1")
    off = float(np.abs(rotation @ rotation.T - np.eye(3)).max())
    if off > tolerance or np.linalg.det(rotation) < 0:
        raise RecordingError(
            f"{path}: key '{key}': is not rigid: its 3x3 part is off a rotation by {off:.1e} "
            f"(determinant {np.linalg.det(rotation):.3f}); expected R R^T = I, determinant 1"
        )
    # What is a rotation already stays as published, to the last bit.
    if off > ROUNDING:
        rotation = nearest_rotation(rotation)
    return SE3(rotation, matrix[:3, 3])


def level_body(up_imu: F64, T_imu_camera: SE3) -> SE3:
    """T_body_imu of a body at the IMU: z along the unit vector `up_imu` (3,), x where the camera
    looks, levelled; where it looks straight down, x is where the image's top points."""
    _, y_camera, z_camera = T_imu_camera.rotation.T
    ahead = z_camera - y_camera
    forward = ahead - (ahead @ up_imu) * up_imu
    x = forward / np.linalg.norm(forward)
    return SE3(nearest_rotation(np.stack([x, np.cross(up_imu, x), up_imu])), np.zeros(3))

"""Plain TUM RGB-D folders, as TU Munich and others publish them.

    rgb.txt  rgb/             colour, 8 bit, PNG or JPEG
    depth.txt  depth/*.png    16 bit, 5000 per metre, 0 is missing, registered to the colour
    associations.txt          pairs of both, in place of the two lists
    accelerometer.txt         of a Kinect; may be missing
    imu0/{sensor.yaml,data.csv} mag0/data.csv    in EuRoC's form; TUM's own have none

The folders have no calibration: the published one of the Kinect in the folder's name is used,
or a file. Without a gyro a recording has no IMU; the accelerometer then gives only the
direction of gravity at the start."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np

from airground.core.arrays import F64
from airground.core.cloud import Source
from airground.errors import RecordingError
from airground.io.euroc import read_lines
from airground.io.folder_links import check_links
from airground.io.frame_numbers import SECOND_NS, are_frame_numbers, stamps_of
from airground.io.lens import KINECT_READOUT_S, Lens
from airground.io.plain_euroc import UP_LEVEL_CAMERA
from airground.io.rgbd_folder import (
    RgbdFolder,
    calibration_in,
    depth_scale_of,
    frame_rate,
    lens_of,
)
from airground.io.robot_recording import RobotRecording
from airground.io.tum import parse_stamp
from airground.io.tum_lists import COLOUR, DEPTH, PAIRS, read_frames

DEPTH_UNITS_PER_M = 5000.0
"""PNG value of one metre of depth, by the format's definition."""
ACCELEROMETER = "accelerometer.txt"

PUBLISHED = {
    "freiburg1": Lens(
        640,
        480,
        (517.3, 516.5, 318.6, 255.3),
        (0.2624, -0.9531, -0.0054, 0.0026, 1.1633),
        readout_s=KINECT_READOUT_S,
    ),
    "freiburg2": Lens(
        640,
        480,
        (520.9, 521.0, 325.1, 249.7),
        (0.2312, -0.7849, -0.0033, -0.0001, 0.9172),
        readout_s=KINECT_READOUT_S,
    ),
    "freiburg3": Lens(640, 480, (535.4, 539.2, 320.1, 247.6), (0.0, 0.0, 0.0, 0.0, 0.0)),
}
"""The colour cameras as the data set's authors calibrated them. The first two are Kinects; the
readout time of the third, an Asus Xtion, is not published, and is taken as 0."""

ACCELEROMETER_AXES = np.array([-1.0, -1.0, 1.0])
"""Factors from a Kinect's accelerometer (left and up positive) to the camera's axes."""
START_S = 0.1
"""Accelerometer readings this close to the first image give the direction of gravity [s]."""


def open_tum(
    path: Path,
    robot: Source,
    calibration_file: Path | None = None,
    depth_units_per_m: float | None = None,
) -> RobotRecording[Any]:
    """Open a folder of colour and depth images and check all but the images.

    Args:
        path: The folder with `rgb.txt` or `associations.txt`.
        robot: Robot that the folder stands for. The MAV's images are grey and without depth;
            without a gyro the scale of its map is unknown.
        calibration_file: Calibration of the colour camera, in the form of EuRoC's `sensor.yaml`.
        depth_units_per_m: PNG value of one metre of depth; None for that of the calibration, or
            the format's.

    Raises:
        RecordingError: One line that names file, key or stamp and what would be right.
    """
    check_links(path)
    calibration_file = calibration_in(path, calibration_file)
    lens = lens_of(calibration_file) or _published_lens(path)
    scale, assumed = depth_scale_of(depth_units_per_m, calibration_file, DEPTH_UNITS_PER_M)
    frames = read_frames(path)
    stamps_ns, rate_hz = frames.stamps_ns, None
    if are_frame_numbers(stamps_ns):
        rate_hz, by_default = frame_rate(calibration_file)
        stamps_ns = stamps_of(stamps_ns // SECOND_NS, rate_hz)
        assumed += by_default
    folder = RgbdFolder(
        path,
        "tum",
        stamps_ns,
        frames.colour,
        frames.depth,
        lens,
        scale,
        frame_rate_hz=rate_hz,
        assumed=assumed,
    )
    return folder.recording(robot, calibration_file, _up_at_start(path, int(stamps_ns[0])))


def _published_lens(path: Path) -> Lens:
    # The folder's name contains the recording's name, and so do comments of the lists.
    comments = [
        line
        for name in (COLOUR, DEPTH, PAIRS, ACCELEROMETER)
        if (path / name).is_file()
        for line in read_lines(path / name)[:3]
        if line.startswith("#")
    ]
    for text in (path.resolve().name, *comments):
        kinect = re.search(r"(?:freiburg|fr)([123])(?![0-9])", text)
        if kinect:
            return PUBLISHED[f"freiburg{kinect[1]}"]
    raise RecordingError(
        f"{path}: the camera's calibration is missing: give it with --calibration FILE, or as "
        "calibration.yaml in the folder (keys resolution, intrinsics, distortion_model, "
        "distortion_coefficients); only names with freiburg1, 2 or 3 have a published one"
    )


def _up_at_start(path: Path, stamp_ns: int) -> F64:
    """(3,) unit vector against gravity in the camera at the first image."""
    file = path / ACCELEROMETER
    if not file.is_file():
        return UP_LEVEL_CAMERA
    readings = []
    for number, line in enumerate(read_lines(file), start=1):
        if not line.strip() or line.startswith("#"):
            continue
        try:
            time, *values = line.split()
            reading = np.array([float(value) for value in values])
            near = abs(parse_stamp(time) - stamp_ns) <= START_S * 1e9
        except ValueError as error:
            raise RecordingError(f"{file}:{number}: {error}") from None
        if reading.shape != (3,) or not np.isfinite(reading).all():
            raise RecordingError(f"{file}:{number}: expected 'timestamp ax ay az', got '{line}'")
        if near:
            readings.append(reading)
    up = np.mean(readings, axis=0) * ACCELEROMETER_AXES if readings else np.zeros(3)
    length = float(np.linalg.norm(up))
    return up / length if length > 1.0 else UP_LEVEL_CAMERA

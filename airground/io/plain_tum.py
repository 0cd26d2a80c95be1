"""Plain TUM RGB-D folders, as TU Munich and others publish them.

    rgb.txt  rgb/*.png        colour, 8 bit
    depth.txt  depth/*.png    16 bit, 5000 per metre, 0 is missing, registered to the colour
    accelerometer.txt         of a Kinect; may be missing
    imu0/{sensor.yaml,data.csv} mag0/data.csv    in EuRoC's form; TUM's own have none

The folders have no calibration: the published one of the Kinect in the folder's name is used,
or a file. Without a gyro a recording has no IMU; the accelerometer then gives only the
direction of gravity at the start."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from airground.core.arrays import F64, I64, U8
from airground.core.cloud import Source
from airground.core.messages import GroundImage, MavImage, RobotCalibration
from airground.core.se3 import SE3
from airground.errors import RecordingError
from airground.io.euroc import read_lines, read_magnetic
from airground.io.image_files import listed_files
from airground.io.images import image_size, read_colour, read_depth
from airground.io.lens import Lens, Undistortion
from airground.io.plain_euroc import UP_LEVEL_CAMERA, Inertial, read_inertial
from airground.io.plausibility import CAMERA_STEP_S, check_stamp_unit, level_body
from airground.io.robot_recording import RobotRecording
from airground.io.sensor_file import read_lens, read_pose
from airground.io.tum import parse_stamp, read_image_list

DEPTH_UNITS_PER_M = 5000.0
"""PNG value of one metre of depth, by the format's definition."""
MAX_DIFFERENCE_NS = 20_000_000
"""Largest difference between the stamps of colour and depth [ns], as in TUM's `associate.py`."""
CALIBRATION_NAMES = ("calibration.yaml", "sensor.yaml", "calibration.toml")
LISTS = ("rgb.txt", "depth.txt", "accelerometer.txt")

PUBLISHED = {
    "freiburg1": Lens(
        640, 480, (517.3, 516.5, 318.6, 255.3), (0.2624, -0.9531, -0.0054, 0.0026, 1.1633)
    ),
    "freiburg2": Lens(
        640, 480, (520.9, 521.0, 325.1, 249.7), (0.2312, -0.7849, -0.0033, -0.0001, 0.9172)
    ),
    "freiburg3": Lens(640, 480, (535.4, 539.2, 320.1, 247.6), (0.0, 0.0, 0.0, 0.0, 0.0)),
}
"""The colour cameras as the data set's authors calibrated them."""

ACCELEROMETER_AXES = np.array([-1.0, -1.0, 1.0])
"""Factors from a Kinect's accelerometer (left and up positive) to the camera's axes."""
START_S = 0.1
"""Accelerometer readings this close to the first image give the direction of gravity [s]."""


def associate(first_ns: I64, second_ns: I64, max_difference_ns: int) -> tuple[I64, I64]:
    """Pair stamps one to one, the nearest pairs first (as TUM's `associate.py` does).

    Args:
        first_ns, second_ns: (N,) and (M,) stamps [ns], strictly increasing.
        max_difference_ns: Largest difference within a pair [ns].

    Returns:
        (P,) indices into each, in order of time.
    """
    low = np.searchsorted(second_ns, first_ns - max_difference_ns, side="left")
    high = np.searchsorted(second_ns, first_ns + max_difference_ns, side="right")
    counts = high - low
    i = np.repeat(np.arange(len(first_ns)), counts)
    # Within each run of equal i, j counts up from its low.
    j = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
    j += np.repeat(low, counts)
    taken_i, taken_j = np.zeros(len(first_ns), bool), np.zeros(len(second_ns), bool)
    pairs = []
    for k in np.lexsort((j, i, np.abs(first_ns[i] - second_ns[j]))):
        if not (taken_i[i[k]] or taken_j[j[k]]):
            taken_i[i[k]] = taken_j[j[k]] = True
            pairs.append((i[k], j[k]))
    pairs.sort()
    table = np.array(pairs, np.int64).reshape(-1, 2)
    return table[:, 0], table[:, 1]


def is_tum_folder(path: Path) -> bool:
    return (path / "rgb.txt").is_file()


def open_tum(
    path: Path, robot: Source, calibration_file: Path | None = None
) -> RobotRecording[Any]:
    """Open a folder of colour and depth images and check all but the images.

    Colour and depth are paired by `associate`, at most 20 ms apart; a frame has the stamp of its
    colour image. Images without a partner are left out.

    Args:
        path: The folder with `rgb.txt`.
        robot: Robot that the folder stands for. The MAV's images are grey and without depth;
            without a gyro the scale of its map is unknown.
        calibration_file: Calibration of the colour camera, in the form of EuRoC's `sensor.yaml`.

    Raises:
        RecordingError: One line that names file, key or stamp and what would be right.
    """
    calibration_file = _calibration_file(path, calibration_file)
    lens = _published_lens(path) if calibration_file is None else read_lens(calibration_file)
    undistortion = Undistortion(lens)
    colour_stamps, colour_names = _image_list(path / "rgb.txt")
    depth_stamps, depth_names = _image_list(path / "depth.txt")
    colour, depth = associate(colour_stamps, depth_stamps, MAX_DIFFERENCE_NS)
    if len(colour) == 0:
        raise RecordingError(
            f"{path / 'depth.txt'}: no depth image is within 20 ms of a colour image of "
            "rgb.txt; both must be stamped by the same clock"
        )
    stamps = colour_stamps[colour]
    colour_files = listed_files(path, colour_names, path / "rgb.txt")
    depth_files = listed_files(path, depth_names, path / "depth.txt")
    files = [(colour_files[c], depth_files[d]) for c, d in zip(colour, depth, strict=True)]
    missing = next((file for pair in files for file in pair if not file.is_file()), None)
    if missing is not None:
        raise RecordingError(f"{missing}: this image is listed but missing")

    def read_grey_image(index: int) -> MavImage:
        colour = read_colour(files[index][0], lens.width, lens.height)
        grey = np.asarray(cv2.cvtColor(colour, cv2.COLOR_RGB2GRAY), np.uint8)
        return MavImage(int(stamps[index]), undistortion.image(grey))

    def read_image(index: int) -> GroundImage:
        colour_file, depth_file = files[index]
        colour = read_colour(colour_file, lens.width, lens.height)
        _check_same_size(depth_file, colour)
        depth = read_depth(depth_file, lens.width, lens.height, DEPTH_UNITS_PER_M)
        return GroundImage(
            int(stamps[index]), undistortion.image(colour), undistortion.depth(depth)
        )

    read_image(0)
    inertial = _inertial(path, calibration_file, stamps)
    T_imu_camera = inertial.T_imu_camera if inertial else SE3.identity()
    up_imu = inertial.up_imu if inertial else _up_at_start(path, int(stamps[0]))
    magnetic_file = path / "mag0" / "data.csv"
    read: Any = read_grey_image if robot == Source.MAV else read_image
    return RobotRecording(
        path=path,
        layout="tum",
        robot=robot,
        calibration=RobotCalibration(
            undistortion.camera,
            T_imu_camera,
            level_body(up_imu, T_imu_camera),
            inertial.noise if inertial else None,
        ),
        camera_stamps=stamps,
        imu=inertial.samples if inertial else None,
        magnetic=read_magnetic(magnetic_file) if magnetic_file.exists() else None,
        read_image=read,
        pose_frame="camera",
        T_pose_camera=SE3.identity(),
    )


def _inertial(path: Path, calibration_file: Path | None, stamps: I64) -> Inertial | None:
    """The IMU of a folder that has one; the camera's calibration gives its pose."""
    if not (path / "imu0").exists():
        return None
    if calibration_file is None:
        raise RecordingError(
            f"{path / 'imu0'}: where the camera sits is unknown; give a calibration with the "
            "key T_BS (--calibration FILE, or calibration.yaml in the folder)"
        )
    return read_inertial(path / "imu0", read_pose(calibration_file), stamps)


def _calibration_file(path: Path, given: Path | None) -> Path | None:
    """The file that the user gave, or one beside the images."""
    candidates = [path / name for name in CALIBRATION_NAMES]
    return given or next((f for f in candidates if f.is_file()), None)


def _published_lens(path: Path) -> Lens:
    # The folder's name contains the recording's name, and so do comments of the lists.
    comments = [
        line
        for name in LISTS
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


def _image_list(path: Path) -> tuple[I64, list[str]]:
    stamps, names = read_image_list(path)
    check_stamp_unit(stamps, path, "seconds", CAMERA_STEP_S)
    return stamps, names


def _check_same_size(depth_file: Path, colour: U8) -> None:
    width, height = image_size(depth_file)
    if (height, width) != colour.shape[:2]:
        raise RecordingError(
            f"{depth_file}: depth is {width}x{height}, its colour image is "
            f"{colour.shape[1]}x{colour.shape[0]}; depth must be registered to the colour "
            "image and of its size"
        )


def _up_at_start(path: Path, stamp_ns: int) -> F64:
    """(3,) unit vector against gravity in the camera at the first image."""
    file = path / "accelerometer.txt"
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

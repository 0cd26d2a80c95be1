"""Folders of 7-Scenes (Microsoft) and of others in its form: one file set a frame, no lists.

    frame-000000.color.png    colour, 8 bit; .jpg in copies
    frame-000000.depth.png    16 bit, millimetres; 0 and 65535 are missing
    frame-000000.pose.txt     camera in world, four rows; never read here
    camera-intrinsics.txt     three rows; in copies

The published focal length of 585 px is the depth camera's: depth is not registered to colour,
unless a copy says so. Frames have numbers in place of stamps."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from airground.core.cloud import Source
from airground.errors import RecordingError
from airground.io.euroc import read_lines
from airground.io.folder_links import check_links
from airground.io.frame_numbers import stamps_of
from airground.io.images import image_size
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
from airground.io.sensor_file import checked_lens

COLOUR = re.compile(r"frame-(\d{1,9})\.color\.(?:png|jpg|jpeg)")
DEPTH_UNITS_PER_M = 1000.0
"""PNG value of one metre of depth, by the data set's description."""
NO_DEPTH = 65535
"""PNG value of a pixel without depth, by the data set's description."""
INTRINSICS = "camera-intrinsics.txt"
PUBLISHED = Lens(
    640, 480, (585.0, 585.0, 320.0, 240.0), (0.0, 0.0, 0.0, 0.0), readout_s=KINECT_READOUT_S
)
"""The depth camera's, by the data set's description; it states none for colour."""


def is_seven_scenes_folder(path: Path) -> bool:
    return next(path.glob("frame-*.color.*"), None) is not None


def open_seven_scenes(
    path: Path,
    robot: Source,
    calibration_file: Path | None = None,
    depth_units_per_m: float | None = None,
) -> RobotRecording[Any]:
    """Open a folder of numbered frames and check all but the images.

    Frames without a depth image are left out.

    Args:
        path: The folder of one sequence.
        robot: Robot that the folder stands for; the MAV's images are grey and without depth.
        calibration_file: Calibration of the colour camera, in the form of EuRoC's `sensor.yaml`.
        depth_units_per_m: PNG value of one metre of depth; None for that of the calibration, or
            the format's.

    Raises:
        RecordingError: One line that names file or key and what would be right.
    """
    check_links(path)
    numbers, colour, depth = _frames(path)
    calibration_file = calibration_in(path, calibration_file)
    scale, assumed = depth_scale_of(depth_units_per_m, calibration_file, DEPTH_UNITS_PER_M)
    rate_hz, by_default = frame_rate(calibration_file)
    assumed += by_default
    lens = lens_of(calibration_file)
    if lens is None and (path / INTRINSICS).is_file():
        lens = _read_matrix(path / INTRINSICS, *image_size(colour[0]))
    if lens is None:
        lens = PUBLISHED
        assumed += ("calibration: 585 px, published for the depth camera",)
    folder = RgbdFolder(
        path,
        "7scenes",
        stamps_of(np.array(numbers, np.int64), rate_hz),
        tuple(colour),
        tuple(depth),
        lens,
        scale,
        NO_DEPTH,
        rate_hz,
        assumed,
    )
    return folder.recording(robot, calibration_file, UP_LEVEL_CAMERA)


def _frames(path: Path) -> tuple[list[int], list[Path], list[Path]]:
    """Numbers, colour files and depth files of the frames that have both, in order."""
    found: dict[int, tuple[Path, Path]] = {}
    for file in sorted(path.iterdir()):
        match = COLOUR.fullmatch(file.name)
        depth = file.with_name(f"{file.name.split('.')[0]}.depth.png")
        if match is None or not depth.is_file():
            continue
        number = int(match[1])
        if number in found:
            raise RecordingError(f"{file}: frame {number} is there twice")
        found[number] = file, depth
    if not found:
        raise RecordingError(
            f"{path}: no frame has colour and depth; expected frame-000000.color.png beside "
            "frame-000000.depth.png"
        )
    numbers = sorted(found)
    return numbers, [found[n][0] for n in numbers], [found[n][1] for n in numbers]


def _read_matrix(path: Path, width: int, height: int) -> Lens:
    """A lens without distortion from the three rows of its matrix; raises RecordingError."""
    try:
        rows = [[float(number) for number in line.split()] for line in read_lines(path)]
        matrix = np.array([row for row in rows if row], np.float64)
    except ValueError as error:
        raise RecordingError(f"{path}: expected three rows of three numbers: {error}") from None
    if matrix.shape != (3, 3) or not np.isfinite(matrix).all():
        raise RecordingError(f"{path}: expected three rows of three numbers")
    intrinsics = tuple(float(matrix[at]) for at in ((0, 0), (1, 1), (0, 2), (1, 2)))
    lens = checked_lens(width, height, intrinsics, "radtan", (0.0,) * 4, path)
    return replace(lens, readout_s=KINECT_READOUT_S)

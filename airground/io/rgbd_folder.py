"""Folders of colour and depth images, whatever their lists look like."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from airground.core.arrays import F32, F64, I64, U8, U16
from airground.core.cloud import Source
from airground.core.messages import GroundImage, MavImage, RobotCalibration
from airground.core.se3 import SE3
from airground.errors import RecordingError
from airground.io.depth_scale import SAMPLES, DepthScale
from airground.io.euroc import read_magnetic
from airground.io.frame_numbers import USUAL_RATE_HZ
from airground.io.images import image_size, read_colour, read_depth, read_units
from airground.io.lens import Lens, Undistortion
from airground.io.plain_euroc import Inertial, read_inertial
from airground.io.plausibility import level_body
from airground.io.robot_recording import RobotRecording
from airground.io.sensor_file import DEPTH_UNITS, RATE, read_lens, read_pose, read_positive

CALIBRATION_NAMES = ("calibration.yaml", "sensor.yaml", "calibration.toml")


@dataclass(frozen=True, eq=False)
class RgbdFolder:
    """What the lists of a folder say, before anything is made of it.

    Attributes:
        path: The folder.
        layout: "tum" or "7scenes".
        stamps_ns: (N,) stamps of the frames [ns].
        colour, depth: N files each.
        lens: Lens of the colour camera.
        scale: Value of one metre of depth.
        missing: Value of a pixel without depth, besides 0.
        frame_rate_hz: Rate by which frame numbers became stamps [Hz]; None where there are stamps.
        assumed: What the folder does not state, and what was taken for it.
    """

    path: Path
    layout: str
    stamps_ns: I64
    colour: tuple[Path, ...]
    depth: tuple[Path, ...]
    lens: Lens
    scale: DepthScale
    missing: int = 0
    frame_rate_hz: float | None = None
    assumed: tuple[str, ...] = ()

    def check(self) -> None:
        """RecordingError where an image is missing, or depth does not fit colour or its scale."""
        files = (file for pair in zip(self.colour, self.depth, strict=True) for file in pair)
        absent = next((file for file in files if not file.is_file()), None)
        if absent is not None:
            raise RecordingError(f"{absent}: this image is listed but missing")
        colour = read_colour(self.colour[0], self.lens.width, self.lens.height)
        self._check_same_size(self.depth[0], colour)
        if not self.scale.stated:
            self.scale.check(self._some_values(), self.depth[0].parent)

    def reader(self, robot: Source, undistortion: Undistortion) -> Callable[[int], Any]:
        """Reads the frame at an index: grey for the MAV, colour and depth for the ground robot."""
        read_measured = self.depth_reader(undistortion)

        def read_grey_image(index: int) -> MavImage:
            colour = read_colour(self.colour[index], self.lens.width, self.lens.height)
            grey = np.asarray(cv2.cvtColor(colour, cv2.COLOR_RGB2GRAY), np.uint8)
            return MavImage(int(self.stamps_ns[index]), undistortion.image(grey))

        def read_image(index: int) -> GroundImage:
            colour = read_colour(self.colour[index], self.lens.width, self.lens.height)
            self._check_same_size(self.depth[index], colour)
            depth = read_measured(index)
            return GroundImage(int(self.stamps_ns[index]), undistortion.image(colour), depth)

        return read_grey_image if robot == Source.MAV else read_image

    def depth_reader(self, undistortion: Undistortion) -> Callable[[int], F32]:
        """Reads the depth of the frame at an index [m]."""
        width, height = self.lens.width, self.lens.height

        def read(index: int) -> F32:
            file, scale = self.depth[index], self.scale.units_per_m
            return undistortion.depth(read_depth(file, width, height, scale, self.missing))

        return read

    def recording(
        self, robot: Source, calibration_file: Path | None, up_camera: F64
    ) -> RobotRecording[Any]:
        """The recording, with the folder's IMU and magnetometer where it has them.

        Args:
            robot: Robot that the folder stands for.
            calibration_file: Calibration with the IMU's `T_BS`; None without.
            up_camera: (3,) unit vector against gravity in the camera at the first image, where no
                IMU measures it.
        """
        self.check()
        undistortion = Undistortion(self.lens)
        inertial = self._inertial(calibration_file)
        T_imu_camera = inertial.T_imu_camera if inertial else SE3.identity()
        magnetic_file = self.path / "mag0" / "data.csv"
        recording: RobotRecording[Any] = RobotRecording(
            path=self.path,
            layout=self.layout,
            robot=robot,
            calibration=RobotCalibration(
                undistortion.camera,
                T_imu_camera,
                level_body(inertial.up_imu if inertial else up_camera, T_imu_camera),
                inertial.noise if inertial else None,
                readout_s=undistortion.readout_s,
            ),
            camera_stamps=self.stamps_ns,
            imu=inertial.samples if inertial else None,
            magnetic=read_magnetic(magnetic_file) if magnetic_file.exists() else None,
            read_image=self.reader(robot, undistortion),
            pose_frame="camera",
            T_pose_camera=SE3.identity(),
            frame_rate_hz=self.frame_rate_hz,
            assumed=self.assumed,
            read_depth=self.depth_reader(undistortion) if robot == Source.MAV else None,
        )
        recording.read_image(0)
        return recording

    def _inertial(self, calibration_file: Path | None) -> Inertial | None:
        """The IMU of a folder that has one; the camera's calibration gives its pose."""
        if not (self.path / "imu0").exists():
            return None
        if calibration_file is None:
            raise RecordingError(
                f"{self.path / 'imu0'}: where the camera sits is unknown; give a calibration with "
                "the key T_BS (--calibration FILE, or calibration.yaml in the folder)"
            )
        return read_inertial(self.path / "imu0", read_pose(calibration_file), self.stamps_ns)

    def _some_values(self) -> U16:
        """(N,) values of the pixels with depth in a few images."""
        last = len(self.depth) - 1
        found = []
        for index in np.unique(np.linspace(0, last, min(SAMPLES, last + 1)).astype(int)):
            units = read_units(self.depth[index], *image_size(self.depth[index]))
            found.append(units[(units > 0) & (units != self.missing)])
        return np.concatenate(found)

    def _check_same_size(self, depth_file: Path, colour: U8) -> None:
        width, height = image_size(depth_file)
        if (height, width) != colour.shape[:2]:
            raise RecordingError(
                f"{depth_file}: depth is {width}x{height}, its colour image is "
                f"{colour.shape[1]}x{colour.shape[0]}; depth must be registered to the colour "
                "image and of its size"
            )


def calibration_in(path: Path, given: Path | None) -> Path | None:
    """The file that the user gave, or one beside the images."""
    candidates = [path / name for name in CALIBRATION_NAMES]
    return given or next((f for f in candidates if f.is_file()), None)


def lens_of(calibration_file: Path | None) -> Lens | None:
    return None if calibration_file is None else read_lens(calibration_file)


def depth_scale_of(
    given: float | None, calibration_file: Path | None, usual: float
) -> tuple[DepthScale, tuple[str, ...]]:
    """The scale, and what was assumed.

    Args:
        given: Value of one metre that the user stated; None where not.
        calibration_file: Calibration, which may state it; None without.
        usual: Value of one metre in this kind of folder.
    """
    stated = given
    if stated is None and calibration_file is not None:
        stated = read_positive(calibration_file, DEPTH_UNITS)
    if stated is not None:
        return DepthScale(stated, stated=True), ()
    return DepthScale(usual, stated=False), (f"depth: {usual:g} per metre, usual for its format",)


def frame_rate(calibration_file: Path | None) -> tuple[float, tuple[str, ...]]:
    """The rate of images without stamps [Hz] by the calibration, and what was assumed."""
    stated = None if calibration_file is None else read_positive(calibration_file, RATE)
    if stated is not None:
        return stated, ()
    return USUAL_RATE_HZ, (f"stamps: frame numbers at {USUAL_RATE_HZ:g} Hz",)

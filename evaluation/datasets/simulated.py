"""A simulated recording with its truth: the source of every exported format."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from airground.core.cloud import Source
from airground.core.messages import ImuSamples, MagneticSamples
from airground.core.se3 import SE3
from airground.errors import InputError, RecordingError
from airground.io.calibration import RobotTable
from airground.io.image_files import ImageFiles
from airground.io.images import read_image_bytes
from airground.io.layout import HEADER
from airground.io.recording_folder import RecordingFolder
from airground.io.robot_recording import RobotRecording
from sim.recording.truth import Truth
from sim.robots.motion import Robot
from sim.robots.robot_motion import RobotMotion


@dataclass(frozen=True, eq=False)
class Simulated:
    """What one robot or both sensed, the truth, and the files of the images."""

    recording: RecordingFolder
    truth: Truth
    files: ImageFiles

    @classmethod
    def open(cls, path: Path) -> Simulated:
        """Open a recording, and compare its files with their digests.

        Raises:
            InputError: It is no recording of simulate, is damaged, has no truth, or has images
                outside of its motion.
        """
        if path.is_dir() and not (path / HEADER).exists():
            raise InputError(
                f"{path}: has no {HEADER}; only recordings that simulate has written have all "
                "that other formats need, their truth above all"
            )
        recording = RecordingFolder.open(path)
        recording.verify()
        assert isinstance(recording.images, ImageFiles)
        truth = Truth.open(path)
        simulated = cls(recording, truth, recording.images)
        for robot in simulated.robots:
            stamps_ns = simulated.stamps_ns(robot)
            for stamp_ns in (stamps_ns[0], stamps_ns[-1]):
                truth.row_poses(robot, stamp_ns)
            # An IMU may have been silent for a while, and the truth goes on.
            if not np.isin(simulated.imu_times_ns(robot), truth.motion.stamps_ns).all():
                raise RecordingError(
                    f"{truth.folder}: its motion has other stamps than the {robot.upper()} IMU"
                )
        return simulated

    @property
    def robots(self) -> tuple[Robot, ...]:
        """The robots that were recorded."""
        return self.recording.header.frames.robots()

    def check_recorded(self, robots: Sequence[Robot]) -> None:
        """RecordingError if one of the robots was not recorded."""
        for robot in robots:
            self.sensed(robot)

    def sensed(self, robot: Robot) -> RobotRecording[Any]:
        """What a robot sensed; RecordingError if it was not recorded."""
        return self.recording.of(Source[robot.upper()])

    def nominal(self, robot: Robot) -> RobotTable:
        """The nominal calibration, which the pipeline uses."""
        calibration = self.recording.header.calibration
        return calibration.mav if robot == "mav" else calibration.ground

    def motion(self, robot: Robot) -> RobotMotion:
        return self.truth.motion.robot(robot)

    def stamps_ns(self, robot: Robot) -> list[int]:
        """Stamps of the robot's images [ns]."""
        return self.sensed(robot).camera_stamps.tolist()

    def image_files(self, robot: Robot) -> Sequence[Path]:
        """Files of the robot's grey or colour images, in order of time."""
        return self.files.mav_files if robot == "mav" else self.files.ground_colour_files

    def samples(self, robot: Robot) -> tuple[ImuSamples, MagneticSamples]:
        """All samples of the robot's IMU and magnetometer."""
        sensed = self.sensed(robot)
        assert sensed.imu is not None
        assert sensed.magnetic is not None
        return sensed.imu, sensed.magnetic

    def imu_times_ns(self, robot: Robot) -> NDArray[np.int64]:
        """(N,) times of the motion at which the robot's inertial samples were taken [ns]."""
        samples, _ = self.samples(robot)
        return self.truth.clock(robot).times_ns(samples.stamps_ns)

    def motion_stamps_ns(self, robot: Robot) -> NDArray[np.int64]:
        """(N,) stamps by the robot's clock of the states of its motion [ns]."""
        return self.truth.clock(robot).stamps_ns(self.truth.motion.stamps_ns)

    def T_imu_camera(self, robot: Robot) -> SE3:
        """Nominal pose of the camera."""
        return SE3.from_matrix(self.nominal(robot).T_imu_camera)


def copy_images(files: Sequence[Path], folder: Path) -> None:
    """Copy images into a new folder, byte by byte, under their own names."""
    folder.mkdir(parents=True)
    for file in files:
        (folder / file.name).write_bytes(read_image_bytes(file))

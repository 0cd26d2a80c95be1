"""A recording of ours with its truth, as what is handed out is made from."""

from __future__ import annotations

import shutil
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from airground.core.messages import ImuSamples, MagneticSamples
from airground.core.se3 import SE3
from airground.core.trajectory import Trajectory
from airground.errors import InputError
from airground.io.calibration import RobotTable
from airground.io.image_files import ImageFiles
from airground.io.layout import HEADER
from airground.io.recording import Recording
from airground.io.robot_recording import RobotRecording
from sim.recording.truth import Truth
from sim.robots.motion import Robot
from sim.robots.robot_motion import RobotMotion


@dataclass(frozen=True, eq=False)
class Simulated:
    """What both robots sensed, and what was true.

    Attributes:
        recording: As the pipeline reads it.
        truth: What really was.
        files: Where the images lie.
    """

    recording: Recording
    truth: Truth
    files: ImageFiles

    @classmethod
    def open(cls, path: Path) -> Simulated:
        """Open a recording, and compare its files with their digests.

        Raises:
            InputError: It is none of ours, is damaged, or has no truth.
        """
        if path.is_dir() and not (path / HEADER).exists():
            raise InputError(
                f"{path}: has no {HEADER}; only recordings that simulate has written have all "
                "that other formats need, their truth above all"
            )
        recording = Recording.open(path)
        recording.verify()
        assert isinstance(recording.images, ImageFiles)
        return cls(recording, Truth.open(path), recording.images)

    def told(self, robot: Robot) -> RobotTable:
        """The calibration that a user of the sensors is told."""
        calibration = self.recording.header.calibration
        return calibration.mav if robot == "mav" else calibration.ground

    def motion(self, robot: Robot) -> RobotMotion:
        """What the robot really did."""
        return self.truth.motion.robot(robot)

    def stamps_ns(self, robot: Robot) -> list[int]:
        """Of the robot's images."""
        return self._sensed(robot).camera_stamps.tolist()

    def _sensed(self, robot: Robot) -> RobotRecording:
        return self.recording.mav if robot == "mav" else self.recording.ground

    def image_files(self, robot: Robot) -> Sequence[Path]:
        """Of the robot's camera, grey or colour, in order of time."""
        return self.files.mav_files if robot == "mav" else self.files.ground_colour_files

    def samples(self, robot: Robot) -> tuple[ImuSamples, MagneticSamples]:
        """What the robot's IMU and magnetometer measured."""
        sensed = self._sensed(robot)
        assert sensed.imu is not None
        assert sensed.magnetic is not None
        return sensed.imu, sensed.magnetic

    def true_cameras(self, robot: Robot) -> Trajectory:
        """`T_world_camera` of every image, by the stamps that the images bear."""
        stamps = self.stamps_ns(robot)
        poses = [self.truth.T_world_camera(robot, stamp) for stamp in stamps]
        return Trajectory.from_poses(stamps, poses)

    def T_imu_camera(self, robot: Robot) -> SE3:
        """As told."""
        return SE3.from_matrix(self.told(robot).T_imu_camera)


def copy_images(files: Sequence[Path], folder: Path) -> None:
    """Copy images into a new folder, byte by byte, under their own names."""
    folder.mkdir(parents=True)
    for file in files:
        shutil.copyfile(file, folder / file.name)

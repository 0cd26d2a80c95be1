"""What one robot alone sensed, whoever recorded it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from airground.core.arrays import read_only
from airground.core.cloud import Source
from airground.core.messages import (
    GroundImage,
    ImuSamples,
    MagneticSamples,
    MavImage,
    RobotCalibration,
    Stamped,
)
from airground.core.se3 import SE3
from airground.io.message_order import bundles


@dataclass(frozen=True, eq=False)
class RobotRecording:
    """One robot's messages, with images of a pinhole camera.

    Attributes:
        path: The folder.
        layout: "airground", "euroc" or "tum".
        robot: Who recorded it, or is to be taken for it.
        calibration: What the front end is told.
        camera_stamps: (N,) int64 of the images [ns].
        imu: All inertial samples; None where there is no gyro.
        magnetic: All magnetometer samples; None where there are none.
        read_image: The image at an index in `camera_stamps`.
        pose_frame: Whose pose the folder's publisher states: "body", "imu" or "camera".
        T_pose_camera: The camera in that frame, so that trajectories can be written of it.
    """

    path: Path
    layout: str
    robot: Source
    calibration: RobotCalibration
    camera_stamps: NDArray[np.int64]
    imu: ImuSamples | None
    magnetic: MagneticSamples | None
    read_image: Callable[[int], MavImage] | Callable[[int], GroundImage]
    pose_frame: str
    T_pose_camera: SE3

    def __post_init__(self) -> None:
        stamps = read_only(self.camera_stamps, "camera_stamps", (None,), np.int64)
        object.__setattr__(self, "camera_stamps", stamps)

    @property
    def duration_s(self) -> float:
        """From the first image to the last [s]."""
        return float(self.camera_stamps[-1] - self.camera_stamps[0]) / 1e9

    def messages(self) -> Iterator[Stamped]:
        """Every message in order of time; samples come before the image that they precede.

        Raises:
            RecordingError: An image cannot be read or does not fit the calibration.
        """
        for _, bundle in self.bundles():
            yield from bundle

    def bundles(self) -> Iterator[tuple[int, list[Stamped]]]:
        """Each image's stamp, and the image after the samples since the one before it."""
        images = (self.read_image(index) for index in range(len(self.camera_stamps)))
        return bundles(self.robot, images, self.imu, self.magnetic)

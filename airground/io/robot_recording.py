"""What one robot sensed, and what two robots sensed together, for any layout on disk."""

from __future__ import annotations

import heapq
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from operator import itemgetter
from pathlib import Path
from types import MappingProxyType
from typing import Any, Generic, TypeVar

import numpy as np

from airground.core.arrays import F32, I64, freeze
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
from airground.core.work_ahead import read_ahead
from airground.errors import RecordingError
from airground.io.frame_numbers import SECOND_NS, numbers_of

NOTHING: Mapping[Source, Collection[int]] = MappingProxyType({})
BOTH = (Source.GROUND, Source.MAV)
"""Both robots; where stamps are equal, the ground robot's messages come first."""

Image = TypeVar("Image", MavImage, GroundImage)


@dataclass
class Bundler:
    """Puts the samples since the previous image before each image.

    A bundle has at most one message of inertial and one of magnetic samples. The samples of an
    image that is left out go into the next bundle. `imu` or `magnetic` is None without the sensor.
    """

    robot: Source
    imu: ImuSamples | None
    magnetic: MagneticSamples | None
    _previous_ns: int = np.iinfo(np.int64).min

    def bundle(self, image: MavImage | GroundImage) -> list[Stamped]:
        """The messages that end with this image."""
        bundle = []
        for sensor in (self.imu, self.magnetic):
            if sensor is not None:
                samples = sensor.between(self._previous_ns, image.stamp_ns)
                if len(samples.stamps_ns):
                    bundle.append(Stamped(self.robot, samples))
        bundle.append(Stamped(self.robot, image))
        self._previous_ns = image.stamp_ns
        return bundle


@dataclass(frozen=True, eq=False)
class RobotRecording(Generic[Image]):
    """One robot's messages, with images of a pinhole camera.

    Attributes:
        path: The folder.
        layout: "airground", "euroc", "tum", "7scenes" or "ros".
        robot: The robot that recorded it, or whose place it takes.
        calibration: The nominal calibration, as front ends use it.
        camera_stamps: (N,) int64 stamps of the images [ns].
        imu, magnetic: All samples; None without a gyro or without a magnetometer.
        read_image: Reads the image at an index of `camera_stamps`.
        pose_frame: Frame whose poses the publisher states as truth: "body", "imu" or "camera".
        T_pose_camera: Pose of the camera in that frame, to write comparable trajectories.
        frame_rate_hz: Rate by which the publisher's frame numbers became stamps [Hz]; None where
            the recording has stamps.
        assumed: What the recording does not state, and what was taken for it.
        read_depth: Reads the measured depth of the image at an index, (height, width) float32 [m],
            NaN where missing, of a MAV's folder that has it, for comparison alone; else None.
    """

    path: Path
    layout: str
    robot: Source
    calibration: RobotCalibration
    camera_stamps: I64
    imu: ImuSamples | None
    magnetic: MagneticSamples | None
    read_image: Callable[[int], Image]
    pose_frame: str
    T_pose_camera: SE3
    frame_rate_hz: float | None = None
    assumed: tuple[str, ...] = ()
    read_depth: Callable[[int], F32] | None = None

    def __post_init__(self) -> None:
        freeze(self, "camera_stamps", (None,), np.int64)

    @property
    def duration_s(self) -> float:
        """Time from the first image to the last [s]."""
        return float(self.camera_stamps[-1] - self.camera_stamps[0]) / 1e9

    def image_at(self, stamp_ns: int) -> Image:
        """The image with this stamp; ValueError if there is none."""
        index = int(np.searchsorted(self.camera_stamps, stamp_ns))
        if index == len(self.camera_stamps) or self.camera_stamps[index] != stamp_ns:
            raise ValueError(f"no image has the stamp {stamp_ns}")
        return self.read_image(index)

    def published_stamps(self, stamps_ns: I64) -> I64:
        """Stamps (N,) [ns] as the publisher counts: frame numbers, where it does, as seconds."""
        if self.frame_rate_hz is None:
            return stamps_ns
        return numbers_of(stamps_ns, self.frame_rate_hz) * SECOND_NS

    def bundler(self) -> Bundler:
        """Puts this robot's samples before its images."""
        return Bundler(self.robot, self.imu, self.magnetic)

    def messages(self) -> Iterator[Stamped]:
        """Every message in order of time; samples come before the image that they precede.

        Raises:
            RecordingError: An image cannot be read or does not fit the calibration.
        """
        bundler = self.bundler()
        for index in range(len(self.camera_stamps)):
            yield from bundler.bundle(self.read_image(index))

    def bundles(
        self, pool: ThreadPoolExecutor, dropped: Collection[int] = ()
    ) -> Iterator[tuple[int, list[Stamped]]]:
        """Each image's stamp, and the image after the samples since the one before it.
        The pool reads images ahead; those with `dropped` stamps [ns] are left out."""
        bundler = self.bundler()
        stamps = self.camera_stamps.tolist()
        kept = [index for index, stamp in enumerate(stamps) if stamp not in dropped]
        for image in read_ahead(pool, self.read_image, kept):
            yield image.stamp_ns, bundler.bundle(image)


@dataclass(frozen=True, eq=False)
class Pair:
    """Recordings of a MAV and of a ground robot, stamped by the same clock.

    Raises:
        RecordingError: The ground robot begins after the MAV has ended: there is no map to
            locate the MAV in.
    """

    mav: RobotRecording[MavImage]
    ground: RobotRecording[GroundImage]

    def __post_init__(self) -> None:
        assert (self.mav.robot, self.ground.robot) == (Source.MAV, Source.GROUND)
        check_same_clock(self.mav, self.ground)

    def of(self, robot: Source) -> RobotRecording[Any]:
        return self.mav if robot == Source.MAV else self.ground

    def messages(
        self, dropped: Mapping[Source, Collection[int]] = NOTHING, robots: Sequence[Source] = BOTH
    ) -> Iterator[Stamped]:
        """Every message in order of time.

        Before each image come the inertial and magnetic samples since the previous image
        of the same robot, one message each unless there are none.

        Args:
            dropped: Stamps [ns] of images to leave out; their samples come before the next image.
            robots: Robots to read; at equal stamps the first one's messages come first.

        Raises:
            RecordingError: An image cannot be read or does not fit the calibration.
        """
        with ThreadPoolExecutor(1) as pool:
            streams = [self.of(robot).bundles(pool, dropped.get(robot, ())) for robot in robots]
            for _, bundle in heapq.merge(*streams, key=itemgetter(0)):
                yield from bundle


def check_same_clock(mav: RobotRecording[Any], ground: RobotRecording[Any]) -> None:
    """RecordingError if the ground robot begins after the MAV has ended."""
    late_ns = int(ground.camera_stamps[0]) - int(mav.camera_stamps[-1])
    if late_ns > 0:
        raise RecordingError(
            f"{ground.path}: begins {late_ns / 1e9:.1f} s after {mav.path} ended; "
            "both must be stamped by the same clock, and the ground robot must come first"
        )

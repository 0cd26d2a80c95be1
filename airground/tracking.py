"""The lower half of Figure 4: each robot tracks on its own and sends frames to the mapper.

A tracker never depends on the mapper, and its frames never change afterwards: mapping gives the
same result in this process or in another one, at any speed."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

from airground.core.cloud import Source
from airground.core.messages import (
    GroundImage,
    ImuSamples,
    MagneticSamples,
    MavImage,
    Message,
    RobotCalibration,
    Stamped,
)
from airground.core.trajectory import Trajectory
from airground.localization.heading import HeadingEstimator
from airground.slam.front_end import FrontEnd, TrackedPose


@dataclass(frozen=True)
class FrontEnds:
    """The front ends of both robots (Sec. IV)."""

    mav: FrontEnd[MavImage]
    ground: FrontEnd[GroundImage]


@dataclass(frozen=True, eq=False)
class TrackedFrame:
    """One image, and what the mapper receives with it.

    Attributes:
        image, pose: Image of the robot's camera, and the front end's answer to it.
        north_rad: Direction of magnetic north in the robot's map [rad]; None while unknown.
        trajectory: Poses of all images so far, where this image of the ground robot corrected its
            map; else None.
    """

    image: MavImage | GroundImage
    pose: TrackedPose
    north_rad: float | None = None
    trajectory: Trajectory | None = None

    @property
    def robot(self) -> Source:
        return Source.MAV if isinstance(self.image, MavImage) else Source.GROUND

    @property
    def stamp_ns(self) -> int:
        return self.image.stamp_ns


class RobotTracker:
    """Poses of one robot, and the direction of magnetic north in its map."""

    def __init__(
        self, robot: Source, calibration: RobotCalibration, front_end: FrontEnd[Any]
    ) -> None:
        self._robot, self._front_end = robot, front_end
        self._T_camera_imu = calibration.T_imu_camera.inverse()
        self._magnetic: list[MagneticSamples] = []
        self._north = HeadingEstimator()

    def add(self, message: Message) -> TrackedFrame | None:
        """Take in one message; every image gives a frame."""
        match message:
            case ImuSamples():
                self._front_end.add_imu(message)
            case MagneticSamples():
                self._magnetic.append(message)
            case MavImage() | GroundImage():
                return self._track(message)
        return None

    def finish(self) -> Trajectory | None:
        """Finish after the last image; returns the final poses of all images."""
        self._front_end.finish()
        return self._front_end.trajectory()

    def _track(self, image: MavImage | GroundImage) -> TrackedFrame:
        pose = self._front_end.track(image)
        trajectory = None
        # Samples from before the first attitude are of no use.
        magnetic, self._magnetic = self._magnetic, []
        if pose.T_map_camera is not None:
            for samples in magnetic:
                self._north.add(samples.field, pose.T_map_camera @ self._T_camera_imu)
            # The MAV's surfaces do not follow corrections, so that its path is not needed.
            if pose.corrected and self._robot == Source.GROUND:
                trajectory = self._front_end.trajectory()
        return TrackedFrame(image, pose, self._north.heading(), trajectory)


class Trackers:
    """Both robots' trackers, fed from one stream of messages; `mav`, `ground`: calibrations."""

    def __init__(
        self, mav: RobotCalibration, ground: RobotCalibration, front_ends: FrontEnds
    ) -> None:
        self._trackers = {
            Source.MAV: RobotTracker(Source.MAV, mav, front_ends.mav),
            Source.GROUND: RobotTracker(Source.GROUND, ground, front_ends.ground),
        }

    def frames(self, messages: Iterable[Stamped]) -> Iterator[TrackedFrame]:
        """A frame for each image among messages in order of time."""
        for stamped in messages:
            frame = self._trackers[stamped.robot].add(stamped.message)
            if frame is not None:
                yield frame

    def finish(self) -> Trajectory | None:
        """Finish after the last message; returns the final path of the ground robot."""
        self._trackers[Source.MAV].finish()
        return self._trackers[Source.GROUND].finish()


class HandOver:
    """Frames of one robot on their way to the mapper, some of which are dropped.
    The correction of the map in a dropped frame goes into the next frame that arrives."""

    def __init__(self) -> None:
        self._correction: Trajectory | None = None

    def leave_out(self, frame: TrackedFrame) -> None:
        """This frame does not reach the mapper."""
        if frame.trajectory is not None:
            self._correction = frame.trajectory

    def pass_on(self, frame: TrackedFrame) -> TrackedFrame:
        """The frame as the mapper receives it."""
        if frame.trajectory is None and self._correction is not None:
            frame = replace(frame, trajectory=self._correction)
        self._correction = None
        return frame


def without(
    frames: Iterable[TrackedFrame], left_out: Mapping[Source, Collection[int]]
) -> Iterator[TrackedFrame]:
    """Frames that reach the mapper when those with certain stamps [ns] do not."""
    hand_overs = {robot: HandOver() for robot in Source}
    for frame in frames:
        hand_over = hand_overs[frame.robot]
        if frame.stamp_ns in left_out.get(frame.robot, ()):
            hand_over.leave_out(frame)
        else:
            yield hand_over.pass_on(frame)

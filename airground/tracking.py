"""The lower half of Figure 4: each robot tracks on its own, and tells the mapper frame by frame.

A tracker never asks the mapper anything. What it hands over stays as it is, so that mapping
gives the same result whenever it gets to it, in this process or in another one.
"""

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
    """Who says where the cameras are (Sec. IV)."""

    mav: FrontEnd[MavImage]
    ground: FrontEnd[GroundImage]


@dataclass(frozen=True, eq=False)
class TrackedFrame:
    """One image, and all that the mapper is told with it.

    Attributes:
        image: As the camera took it.
        pose: Where the camera was, if that is known.
        north_rad: Direction of magnetic north in the robot's map by now; None while unknown.
        trajectory: Every image tracked so far where it is believed to be now, of the ground
            robot and where its map was corrected with this image; else None.
    """

    image: MavImage | GroundImage
    pose: TrackedPose
    north_rad: float | None = None
    trajectory: Trajectory | None = None

    @property
    def robot(self) -> Source:
        """Whose it is."""
        return Source.MAV if isinstance(self.image, MavImage) else Source.GROUND

    @property
    def stamp_ns(self) -> int:
        """When the image was taken."""
        return self.image.stamp_ns


class RobotTracker:
    """Poses of one robot, and where magnetic north lies in its map.

    Args:
        robot: Which one.
        calibration: What is known about its sensors.
        front_end: Who says where its camera is.
    """

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
        """There are no more images: every image where it is believed to be at last."""
        self._front_end.finish()
        return self._front_end.trajectory()

    def _track(self, image: MavImage | GroundImage) -> TrackedFrame:
        pose = self._front_end.track(image)
        trajectory = None
        # What was measured before the robot knew its attitude says nothing.
        magnetic, self._magnetic = self._magnetic, []
        if pose.T_map_camera is not None:
            for samples in magnetic:
                self._north.add(samples.field, pose.T_map_camera @ self._T_camera_imu)
            # Surfaces that the MAV has handed over stay as they were: nobody needs its path.
            if pose.corrected and self._robot == Source.GROUND:
                trajectory = self._front_end.trajectory()
        return TrackedFrame(image, pose, self._north.heading(), trajectory)


class Trackers:
    """Both robots' trackers, fed from one stream of messages.

    Args:
        mav, ground: What is known about the robots' sensors.
        front_ends: Who says where the cameras are.
    """

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
        """There are no more messages; returns the ground robot's path as believed at last."""
        self._trackers[Source.MAV].finish()
        return self._trackers[Source.GROUND].finish()


class HandOver:
    """Frames of one robot on their way to the mapper, of which some may not arrive.

    One that does not leaves its correction of the map to the next that does.
    """

    def __init__(self) -> None:
        self._correction: Trajectory | None = None

    def leave_out(self, frame: TrackedFrame) -> None:
        """This frame does not reach the mapper."""
        if frame.trajectory is not None:
            self._correction = frame.trajectory

    def pass_on(self, frame: TrackedFrame) -> TrackedFrame:
        """What reaches the mapper with this frame."""
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

"""Robots that play a recording made by hand, on a clock that the test sets."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from airground.core.cloud import Source
from airground.core.messages import GroundImage, ImuSamples, MavImage
from airground.core.se3 import SE3
from airground.core.trajectory import Trajectory
from airground.io.recording import Recording
from airground.link.channel import Receiver, Sender
from airground.link.frame_codec import pack
from airground.slam.front_end import TrackedPose, Tracking
from airground.tracking import FrontEnds, RobotTracker, TrackedFrame, Trackers
from evaluation.run.drops import DropList, Stamps, fingerprint
from evaluation.run.live.arrivals import Stream, in_order
from evaluation.run.live.playback import Played, play
from evaluation.run.live.radio_link import Radio, RadioLimits, Uplink


class SteppedClock:
    """A clock that moves only when it is set."""

    def __init__(self) -> None:
        self.time_ns = 0

    def now_ns(self) -> int:
        return self.time_ns

    def wait_until(self, stamp_ns: int) -> None:
        self.time_ns = max(self.time_ns, stamp_ns)


class DigestFrontEnd:
    """A front end whose poses depend on all its inputs; each image may take a set time.

    Each pose depends on every sample and image before it, as in real tracking, so that
    two runs agree to the bit only if they had the same bundles.
    """

    def __init__(self, clock: SteppedClock | None = None, work_ns: int = 0) -> None:
        self._clock, self._work_ns = clock, work_ns
        self._digest = 1.0
        self.imu_stamps: list[int] = []
        self._poses: dict[int, SE3] = {}

    def add_imu(self, samples: ImuSamples) -> None:
        self.imu_stamps += samples.stamps_ns.tolist()
        self._digest = (self._digest * 1.1 + len(samples.stamps_ns)) % 7.0

    def track(self, image: MavImage | GroundImage) -> TrackedPose:
        if self._clock is not None:
            self._clock.time_ns += self._work_ns
        pixels = image.image if isinstance(image, MavImage) else image.colour
        self._digest = (self._digest * 1.3 + float(pixels.mean())) % 5.0
        pose = SE3.from_heading(self._digest, [self._digest, 0.0, 1.0])
        self._poses[image.stamp_ns] = pose
        return TrackedPose(image.stamp_ns, Tracking.TRACKED, pose, corrected=self._digest < 2.0)

    def finish(self) -> None:
        """Nothing to do."""

    def trajectory(self) -> Trajectory | None:
        if not self._poses:
            return None
        return Trajectory.from_poses(list(self._poses), list(self._poses.values()))


@dataclass
class Robots:
    """Both robots with their own trackers, uplinks and clocks, and the outcome of each."""

    recording: Recording
    work_ns: dict[Source, int] = field(default_factory=dict)
    waiting_frames: int = 0
    frames_under_way: int = 100
    radio: RadioLimits | None = None
    uplinks: dict[Source, Uplink] = field(default_factory=dict)
    played: dict[Source, Played] = field(default_factory=dict)
    front_ends: dict[Source, DigestFrontEnd] = field(default_factory=dict)
    streams: dict[Source, Stream] = field(default_factory=dict)

    def play(self) -> None:
        for robot in Source:
            clock = SteppedClock()
            front_end = DigestFrontEnd(clock, self.work_ns.get(robot, 0))
            self.front_ends[robot] = front_end
            receiver = Receiver()
            self.streams[robot] = Stream(receiver, lambda: True)
            radio = self.radio if robot == Source.MAV else None
            uplink = Uplink(
                Sender(receiver.address, self.frames_under_way),
                Radio(radio or RadioLimits(), np.random.default_rng(0)),
                None if radio is None else radio.jpeg_quality,
            )
            tracker = RobotTracker(robot, self.recording.of(robot).calibration, front_end)
            capacity = self.waiting_frames
            self.played[robot] = play(self.recording, robot, tracker, clock, capacity, uplink.offer)
            uplink.close(tracker.finish())
            self.uplinks[robot] = uplink

    def received(self) -> list[TrackedFrame]:
        """Frames that reach the mapper, all messages having arrived."""
        clock = SteppedClock()
        clock.wait_until(10**12)
        return list(in_order(self.streams, clock, patience_s=10.0))

    def drops(self) -> DropList:
        def stamps(by_robot: dict[Source, list[int]]) -> Stamps:
            return Stamps(
                mav=frozenset(by_robot[Source.MAV]), ground=frozenset(by_robot[Source.GROUND])
            )

        return DropList(
            schema=1,
            recording=fingerprint(self.recording),
            dropped=stamps({robot: one.dropped_ns for robot, one in self.played.items()}),
            unmapped=stamps({robot: one.shed + one.lost for robot, one in self.uplinks.items()}),
            jpeg_quality=None if self.radio is None else self.radio.jpeg_quality,
        )


def offline(recording: Recording, drops: DropList) -> list[TrackedFrame]:
    """Frames that reach the mapper in a run offline with the same drop list."""
    front_ends = FrontEnds(DigestFrontEnd(), DigestFrontEnd())
    trackers = Trackers(recording.mav.calibration, recording.ground.calibration, front_ends)
    messages = recording.messages(drops.dropped.by_robot())
    return list(drops.received(trackers.frames(messages)))


def packed(frames: list[TrackedFrame]) -> list[list[bytes]]:
    """The frames as bytes."""
    return [pack(frame) for frame in frames]

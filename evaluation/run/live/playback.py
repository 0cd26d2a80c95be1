"""One robot of a live run, in its own process: clock, camera, bounded queue, tracking, uplink."""

from __future__ import annotations

import importlib
import time
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from multiprocessing.connection import Connection
from typing import Protocol

import numpy as np

from airground.core.cloud import Source
from airground.core.trajectory import Trajectory
from airground.io.recording import Recording
from airground.link.channel import Sender
from airground.tracking import RobotTracker, TrackedFrame
from evaluation.run.live.radio_link import Radio, RadioLimits, Uplink
from evaluation.run.live.stamped_times import StampedTimes
from evaluation.run.robot_process import READY, RobotTask, open_tracker
from evaluation.setup.environment import settle
from evaluation.setup.memory import peak_memory_mib
from evaluation.table.tracking_log import FrontEndLog


class Clock(Protocol):
    """A clock that shows recorded time."""

    def now_ns(self) -> int:
        """Stamp of an image taken now [ns]."""

    def wait_until(self, stamp_ns: int) -> None:
        """Return at `stamp_ns`; at once if that is past."""


@dataclass(frozen=True)
class PlaybackClock:
    """Recorded time, passing `rate` times as fast as the system's monotonic clock.

    All processes of a machine share that clock.

    Attributes:
        first_ns: First stamp of the recording [ns].
        started_ns: Time of that stamp on the monotonic clock [ns].
        rate: Recorded seconds per second.
    """

    first_ns: int
    started_ns: int
    rate: float

    def now_ns(self) -> int:
        return self.first_ns + round((time.monotonic_ns() - self.started_ns) * self.rate)

    def wait_until(self, stamp_ns: int) -> None:
        due_ns = self.started_ns + (stamp_ns - self.first_ns) / self.rate
        seconds = (due_ns - time.monotonic_ns()) * 1e-9
        if seconds > 0:
            time.sleep(seconds)

    def passed_ms(self, since_ns: int, until_ns: int) -> float:
        """Real duration of a span of recorded time [ms]."""
        return (until_ns - since_ns) * 1e-6 / self.rate


@dataclass(frozen=True)
class Playback:
    """Rate and limits of a live run.

    Attributes:
        rate: Recorded seconds per second.
        waiting_frames: Capacity of the queue before each tracker, in images. 30 are one second at
            30 Hz: adjusting the map of ten minutes takes two thirds of that, and the tracker
            works off its queue several times as fast as images arrive.
        frames_under_way: Capacity of the queue before the mapper, in tracked frames per robot:
            five seconds at 30 Hz, 360 MiB when full.
        radio: Limits of the radio from the MAV to the mapper; None on one computer.
        patience_s: Time that the mapper waits for a silent robot [s].
    """

    rate: float = 1.0
    waiting_frames: int = 30
    frames_under_way: int = 150
    radio: RadioLimits | None = None
    patience_s: float = 2.0

    def describe(self) -> str:
        """Label: how this run differs from a run offline."""
        played = "live" if self.rate == 1.0 else f"live, played {self.rate:g} times as fast"
        return played if self.radio is None else f"{played}, radio: {self.radio.describe()}"

    @property
    def jpeg_quality(self) -> int | None:
        """JPEG quality of the MAV's images at the mapper; None if not compressed."""
        return None if self.radio is None else self.radio.jpeg_quality


class FrameQueue:
    """A bounded queue of frames that arrive by the clock; a frame that finds it full is dropped.

    Args:
        stamps_ns: Arrival times of the frames, in order [ns].
        capacity: Number of frames that may wait, besides the one being tracked.

    Attributes:
        dropped: Indices of the dropped frames.
        longest: Largest number of frames that waited.
    """

    def __init__(self, stamps_ns: Sequence[int], capacity: int) -> None:
        self._stamps_ns, self._capacity = stamps_ns, capacity
        self._waiting: deque[int] = deque()
        self._next = 0
        self.dropped: list[int] = []
        self.longest = 0

    def take(self, now_ns: int) -> int | None:
        """Index of the next frame to track, arrived or not; None after the last."""
        while self._next < len(self._stamps_ns) and self._stamps_ns[self._next] <= now_ns:
            if len(self._waiting) < self._capacity:
                self._waiting.append(self._next)
            else:
                self.dropped.append(self._next)
            self._next += 1
        self.longest = max(self.longest, len(self._waiting))
        if self._waiting:
            return self._waiting.popleft()
        if self._next == len(self._stamps_ns):
            return None
        self._next += 1
        return self._next - 1


@dataclass(frozen=True)
class Played:
    """Outcome of one robot's playback.

    Attributes:
        posed_ns: Time at which each tracked image had its pose, by the image's stamp [ns].
        dropped_ns: Stamps of the dropped images [ns].
        longest_queue: Largest number of images that waited.
        processor_s: Processor time of the playback [s].
    """

    posed_ns: Mapping[int, int]
    dropped_ns: list[int]
    longest_queue: int
    processor_s: float


def play(
    recording: Recording,
    robot: Source,
    tracker: RobotTracker,
    clock: Clock,
    capacity: int,
    hand_over: Callable[[TrackedFrame], None],
) -> Played:
    """Track one robot's images as they arrive by the clock.

    A file is decoded before its image is due wherever there is time, since a camera delivers
    pixels. The inertial samples before a dropped image are tracked with the next image. `capacity`
    images may wait. `hand_over` receives each frame that has its pose; it must not block.
    """
    own = recording.of(robot)
    stamps_ns = own.camera_stamps.tolist()
    queue = FrameQueue(stamps_ns, capacity)
    bundler = own.bundler()
    posed_ns = StampedTimes()
    started_s = time.process_time()
    while (index := queue.take(clock.now_ns())) is not None:
        image = own.read_image(index)
        clock.wait_until(image.stamp_ns)
        *samples, last = bundler.bundle(image)
        for stamped in samples:
            tracker.add(stamped.message)
        frame = tracker.add(last.message)
        assert frame is not None
        posed_ns.note(image.stamp_ns, clock.now_ns())
        hand_over(frame)
    return Played(
        posed_ns,
        [stamps_ns[index] for index in queue.dropped],
        queue.longest,
        time.process_time() - started_s,
    )


@dataclass(frozen=True)
class LiveTask:
    """One robot's part of a live run.

    Attributes:
        task: Recording, robot, front end and seed.
        waiting_frames: Images that may wait before the tracker.
        frames_under_way: Frames that may wait before the mapper.
        radio: Limits of the radio to the mapper; None on one computer.
        address: Address at which the mapper listens.
    """

    task: RobotTask
    waiting_frames: int
    frames_under_way: int
    radio: RadioLimits | None
    address: str


@dataclass(frozen=True)
class RobotReport:
    """Outcome of one robot's live run.

    Attributes:
        log: Answers of its front end, image by image.
        final: Its final trajectory; None where it has none.
        played: Outcome of the playback.
        shed_ns: Stamps of frames for which the mapper had no room [ns].
        lost_ns: Stamps of frames that the radio lost [ns].
        sent_bytes: Size of all frames sent, lost ones included.
        most_under_way: Largest number of frames that waited before the mapper.
        peak_memory_mib: Peak memory of the process [MiB].
    """

    log: FrontEndLog
    final: Trajectory | None
    played: Played
    shed_ns: list[int]
    lost_ns: list[int]
    sent_bytes: int
    most_under_way: int
    peak_memory_mib: float


def play_robot(order: LiveTask, pipe: Connection) -> None:
    """Body of the process: sends `READY`, receives the clock, plays, and sends a `RobotReport`."""
    task = order.task
    recording, watched, tracker = open_tracker(task)
    if task.robot.name.lower() in task.setup.slam_robots():
        # Imported here, since SLAM's import at its first closed loop would delay live poses.
        importlib.import_module("open3d")
    settle()
    radio = Radio(order.radio or RadioLimits(), np.random.default_rng([task.seed, 1]))
    sender = Sender(order.address, order.frames_under_way)
    uplink = Uplink(sender, radio, order.radio.jpeg_quality if order.radio else None)
    pipe.send(READY)
    clock: PlaybackClock = pipe.recv()
    played = play(recording, task.robot, tracker, clock, order.waiting_frames, uplink.offer)
    final = tracker.finish()
    uplink.close(final)
    report = RobotReport(
        log=watched.of(task.robot).log(),
        final=final,
        played=played,
        shed_ns=uplink.shed,
        lost_ns=uplink.lost,
        sent_bytes=radio.carried_bytes,
        most_under_way=sender.most_under_way,
        peak_memory_mib=peak_memory_mib(),
    )
    pipe.send(report)

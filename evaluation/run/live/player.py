"""One robot of a live run: images arrive on time, wait in a bounded queue, are tracked and sent."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from airground.core.cloud import Source
from airground.core.messages import GroundImage, MavImage
from airground.io.recording import Recording
from airground.io.robot_recording import Bundler
from airground.tracking import RobotTracker, TrackedFrame
from evaluation.run.live.playback import Clock


class FrameQueue:
    """Frames that come on their own schedule, and are dropped whole where there is no room.

    Args:
        stamps_ns: When each frame comes, in order of time.
        capacity: How many may wait, besides the one that is being tracked.

    Attributes:
        dropped: Indices of the frames that found the buffer full.
        longest: The most that ever waited.
    """

    def __init__(self, stamps_ns: Sequence[int], capacity: int) -> None:
        self._stamps_ns, self._capacity = stamps_ns, capacity
        self._waiting: deque[int] = deque()
        self._next = 0
        self.dropped: list[int] = []
        self.longest = 0

    def take(self, now_ns: int) -> int | None:
        """Index of the frame to track next; it may still have to come. None after the last."""
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
    """How a robot lived through its recording.

    Attributes:
        posed_ns: For each tracked image, by its stamp: when its pose was known.
        dropped_ns: Stamps of the images that found the buffer full.
        longest_queue: The most images that ever waited.
        processor_s: Processor time that all this took.
    """

    posed_ns: dict[int, int]
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
    """Track a recording's images as they come, by the clock.

    A file is decoded before its image is due wherever there is time: a camera hands over
    pixels. Of a dropped image nothing is tracked, but the inertial samples before it are.

    Args:
        recording: Of both robots.
        robot: Which of them.
        tracker: Its tracker.
        clock: Says when an image is there.
        capacity: How many images may wait.
        hand_over: Is given each frame when it has its pose, and does not block.
    """
    stamps_ns = recording.of(robot).camera_stamps.tolist()
    queue = FrameQueue(stamps_ns, capacity)
    bundler = recording.of(robot).bundler()
    posed_ns = {}
    started_s = time.process_time()
    while (index := queue.take(clock.now_ns())) is not None:
        image = recording.of(robot).read_image(index)
        clock.wait_until(image.stamp_ns)
        frame = _tracked(tracker, bundler, image)
        posed_ns[image.stamp_ns] = clock.now_ns()
        hand_over(frame)
    return Played(
        posed_ns,
        [stamps_ns[index] for index in queue.dropped],
        queue.longest,
        time.process_time() - started_s,
    )


def _tracked(
    tracker: RobotTracker, bundler: Bundler, image: MavImage | GroundImage
) -> TrackedFrame:
    """The frame that the image's bundle of messages ends with."""
    *samples, last = bundler.bundle(image)
    for stamped in samples:
        tracker.add(stamped.message)
    frame = tracker.add(last.message)
    assert frame is not None
    return frame

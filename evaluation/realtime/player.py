"""One robot that lives through its recording: frames come, are tracked and sent on."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

from airground.core.cloud import Source
from airground.core.messages import GroundImage, MavImage
from airground.io.message_order import Bundler
from airground.io.recording import Recording
from airground.tracking import RobotTracker, TrackedFrame
from evaluation.realtime.clock import Clock
from evaluation.realtime.frame_queue import FrameQueue


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
    stamps_ns = recording.stamps_ns(robot).tolist()
    queue = FrameQueue(stamps_ns, capacity)
    bundler = Bundler(robot, *recording.samples(robot))
    posed_ns = {}
    started_s = time.process_time()
    while (index := queue.take(clock.now_ns())) is not None:
        image = recording.read_image(robot, index)
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

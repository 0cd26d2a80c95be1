"""Both robots' tracking beside mapping, each in a process of its own, as on the robots."""

from __future__ import annotations

import heapq
import multiprocessing
import time
from collections.abc import Iterator, Sequence
from contextlib import AbstractContextManager, ExitStack
from dataclasses import dataclass
from multiprocessing.connection import Connection
from multiprocessing.context import SpawnContext

import numpy as np
from numpy.typing import DTypeLike, NDArray

from airground.core.cloud import Source
from airground.core.messages import GroundImage, MavImage
from airground.core.trajectory import Trajectory
from airground.io.recording import Recording
from airground.io.robot_recording import BOTH
from airground.slam.front_end import TrackedPose
from airground.tracking import TrackedFrame
from evaluation.run.drops import Stamps
from evaluation.run.robot_process import READY, RobotProcess, RobotTask, open_tracker
from evaluation.run.tracking import FRAMES_AHEAD, TrackingReport, TrackingTask
from evaluation.setup.environment import settle
from evaluation.setup.memory import files_mib, peak_memory_mib

NICENESS = 10
"""Niceness of the processes: mapping takes longer than tracking, so that it goes first."""

PIXEL_BYTES = {Source.MAV: 1, Source.GROUND: 3 + 4}
"""Size of a pixel [bytes]: grey; colour and depth."""


@dataclass(frozen=True)
class _Handed:
    """A frame without its pixels, which lie in a slot: of an image, or of colour and depth."""

    slot: int
    shapes: tuple[tuple[int, ...], ...]
    stamp_ns: int
    pose: TrackedPose
    north_rad: float | None
    trajectory: Trajectory | None


class FrameRing:
    """Images of one robot's frames in memory that two processes share.

    A pipe alone would copy every image four times.

    Args:
        context: Source of the shared memory.
        slots: Number of frames that may be under way; `put` waits for a free slot.
        robot: Robot that the frames are of.
        pixels: Number of pixels of an image.
    """

    def __init__(self, context: SpawnContext, slots: int, robot: Source, pixels: int) -> None:
        self._slots, self._slot_bytes = slots, pixels * PIXEL_BYTES[robot]
        self._memory = context.RawArray("B", slots * self._slot_bytes)
        self._free = context.Semaphore(slots)
        self._put = 0

    @property
    def memory_mib(self) -> float:
        """Size of all slots, which counts in both processes [MiB]."""
        return self._slots * self._slot_bytes / 2**20

    def put(self, frame: TrackedFrame, pipe: Connection) -> None:
        """Send a frame, as soon as a slot is free."""
        image = frame.image
        arrays: Sequence[NDArray] = (
            [image.image] if isinstance(image, MavImage) else [image.colour, image.depth]
        )
        self._free.acquire()
        slot = self._put % self._slots
        shapes = tuple(array.shape for array in arrays)
        for target, array in zip(self._views(slot, shapes), arrays, strict=True):
            np.copyto(target, array)
        pipe.send(
            _Handed(slot, shapes, frame.stamp_ns, frame.pose, frame.north_rad, frame.trajectory)
        )
        self._put += 1

    def take(self, handed: _Handed) -> TrackedFrame:
        """The frame that was sent; frees its slot."""
        arrays = [view.copy() for view in self._views(handed.slot, handed.shapes)]
        self._free.release()
        image: MavImage | GroundImage
        if len(arrays) == 1:
            image = MavImage(handed.stamp_ns, arrays[0])
        else:
            image = GroundImage(handed.stamp_ns, arrays[0], arrays[1])
        return TrackedFrame(image, handed.pose, handed.north_rad, handed.trajectory)

    def _views(self, slot: int, shapes: Sequence[tuple[int, ...]]) -> list[NDArray]:
        """Arrays of these shapes in a slot: grey, or colour and depth."""
        types: tuple[DTypeLike, ...] = (np.float32, np.uint8) if len(shapes) == 2 else (np.uint8,)
        start = slot * self._slot_bytes
        views = []
        # Depth first, so that it begins at a multiple of its four bytes.
        for dtype, shape in zip(types, reversed(shapes), strict=True):
            count = int(np.prod(shape))
            view = np.frombuffer(self._memory, dtype, count, start)
            views.append(view.reshape(shape))
            start += view.nbytes
        return views[::-1]


@dataclass(frozen=True)
class _Order:
    """A robot's task, with the images to leave out and the memory for its frames."""

    task: RobotTask
    dropped: Stamps
    ring: FrameRing


class TrackingApart(AbstractContextManager["TrackingApart"]):
    """Tracks each robot in a process that ends with the block (see `RobotProcess`), with the same
    frames and report as `TrackingHere`. The recording must lie on disk."""

    def __init__(self, task: TrackingTask) -> None:
        self._task = task
        self._rings: dict[Source, FrameRing] = {}
        self._processes: dict[Source, RobotProcess] = {}
        with ExitStack() as stack:
            for robot in BOTH:
                self._processes[robot] = stack.enter_context(self._start(robot))
            self._stack = stack.pop_all()

    def _start(self, robot: Source) -> RobotProcess:
        recording = self._task.recording
        assert isinstance(recording, Recording)
        context = multiprocessing.get_context("spawn")
        camera = recording.of(robot).calibration.camera
        ring = FrameRing(context, FRAMES_AHEAD, robot, camera.width * camera.height)
        self._rings[robot] = ring
        dropped = self._task.drops.dropped if self._task.drops else Stamps()
        task = RobotTask(recording.path, robot, self._task.setup, self._task.seed)
        return RobotProcess(robot, _track, _Order(task, dropped, ring), context)

    @property
    def pids(self) -> list[int]:
        """Identifiers of the processes."""
        return [process.pid for process in self._processes.values()]

    def __exit__(self, *_: object) -> None:
        self._stack.close()

    def wait_until_ready(self) -> None:
        for process in self._processes.values():
            process.wait_until_ready()

    def frames(self) -> Iterator[TrackedFrame]:
        """As `Tracking.frames`; raises AirgroundError if an image cannot be read, or a process
        died."""
        for process in self._processes.values():
            process.start()
        streams = [self._frames(robot) for robot in self._processes]
        return self._task.received(heapq.merge(*streams, key=lambda frame: frame.stamp_ns))

    def _frames(self, robot: Source) -> Iterator[TrackedFrame]:
        while isinstance(handed := self._processes[robot].receive(), _Handed):
            yield self._rings[robot].take(handed)

    def report(self) -> TrackingReport:
        """As `Tracking.report`; raises as `frames` does."""
        reports: dict[Source, TrackingReport] = {
            robot: process.receive() for robot, process in self._processes.items()
        }
        return TrackingReport(
            {name: one for report in reports.values() for name, one in report.tracked.items()},
            reports[Source.GROUND].ground,
            sum(report.processor_s for report in reports.values()),
            sum(report.peak_memory_mib for report in reports.values()),
        )


def _track(order: _Order, pipe: Connection) -> None:
    """Body of the process: sends a frame for each image, `READY`, and one robot's report."""
    task, ring = order.task, order.ring
    recording, watched, tracker = open_tracker(task, NICENESS)
    settle()
    pipe.send(READY)
    pipe.recv()
    started_s = time.process_time()
    for stamped in recording.messages(order.dropped.by_robot(), (task.robot,)):
        frame = tracker.add(stamped.message)
        if frame is not None:
            ring.put(frame, pipe)
    pipe.send(READY)
    path = tracker.finish()
    processor_s = time.process_time() - started_s
    # Without the memory that both processes share: frames under way, and libraries.
    memory_mib = peak_memory_mib() - ring.memory_mib - files_mib()
    tracked = watched.tracked_by(task.robot)
    ground = path if task.robot == Source.GROUND else None
    pipe.send(TrackingReport({tracked.robot: tracked}, ground, processor_s, memory_mib))

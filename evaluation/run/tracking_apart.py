"""Both robots' tracking beside mapping, each in a process of its own, as on the robots."""

from __future__ import annotations

import heapq
import multiprocessing
import time
from collections.abc import Iterator
from contextlib import AbstractContextManager, ExitStack
from dataclasses import dataclass
from multiprocessing.connection import Connection

from airground.core.cloud import Source
from airground.core.trajectory import Trajectory
from airground.io.recording import Recording
from airground.io.robot_recording import BOTH
from airground.tracking import TrackedFrame
from evaluation.run.drops import Stamps
from evaluation.run.frame_ring import FrameRing, Handed
from evaluation.run.robot_process import READY, RobotProcess, RobotTask, open_tracker
from evaluation.run.tracking import FRAMES_AHEAD, TrackingReport, TrackingTask
from evaluation.setup.environment import settle
from evaluation.setup.memory import files_mib, peak_memory_mib
from evaluation.table.tracking_log import Tracked

NICENESS = 10
"""Mapping takes longer than tracking and goes first where both have work."""


@dataclass(frozen=True)
class _Order:
    """A robot's task, with the images to leave out and the memory for its frames."""

    task: RobotTask
    dropped: Stamps
    ring: FrameRing


@dataclass(frozen=True)
class _Report:
    """Outcome of one robot's tracking.

    Attributes:
        tracked: Answers of its front end.
        path: Its final trajectory; None where it has none.
        processor_s: Processor time of the process [s].
        peak_memory_mib: Peak memory of the process, without what it shares with mapping: frames
            under way, and libraries [MiB].
    """

    tracked: Tracked
    path: Trajectory | None
    processor_s: float
    peak_memory_mib: float


class TrackingApart(AbstractContextManager["TrackingApart"]):
    """Tracks each robot in a process that ends with the block (see `RobotProcess`).

    It gives the same frames and the same report as `TrackingHere`.

    Args:
        task: Recording, front ends, seed and drops; the recording must lie on disk.
    """

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
        """Numbers of the processes."""
        return [process.pid for process in self._processes.values()]

    def __exit__(self, *_: object) -> None:
        self._stack.close()

    def wait_until_ready(self) -> None:
        """As `Tracking.wait_until_ready`."""
        for process in self._processes.values():
            process.wait_until_ready()

    def frames(self) -> Iterator[TrackedFrame]:
        """As `Tracking.frames`.

        Raises:
            AirgroundError: An image cannot be read, or a process died.
        """
        for process in self._processes.values():
            process.start()
        streams = [self._frames(robot) for robot in self._processes]
        return self._task.received(heapq.merge(*streams, key=lambda frame: frame.stamp_ns))

    def _frames(self, robot: Source) -> Iterator[TrackedFrame]:
        while isinstance(handed := self._processes[robot].receive(), Handed):
            yield self._rings[robot].take(handed)

    def report(self) -> TrackingReport:
        """As `Tracking.report`; raises as `frames` does."""
        reports: dict[Source, _Report] = {
            robot: process.receive() for robot, process in self._processes.items()
        }
        return TrackingReport(
            {report.tracked.robot: report.tracked for report in reports.values()},
            reports[Source.GROUND].path,
            sum(report.processor_s for report in reports.values()),
            sum(report.peak_memory_mib for report in reports.values()),
        )


def _track(order: _Order, pipe: Connection) -> None:
    """Body of the process: a frame for each image, `READY`, and the report."""
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
    memory_mib = peak_memory_mib() - ring.memory_mib - files_mib()
    pipe.send(_Report(watched.tracked_by(task.robot), path, processor_s, memory_mib))

"""Each robot's tracking in a process of its own, beside mapping, as on the robots."""

from __future__ import annotations

import heapq
import multiprocessing
import os
import time
from collections.abc import Iterator
from contextlib import AbstractContextManager
from dataclasses import dataclass
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

import numpy as np

from airground.core.cloud import Source
from airground.core.trajectory import Trajectory
from airground.errors import AirgroundError
from airground.io.recording import Recording
from airground.io.robot_recording import BOTH
from airground.slam.warm_up import warm_up_slam
from airground.tracking import RobotTracker, TrackedFrame
from evaluation.run.drops import DropList
from evaluation.run.frame_ring import FrameRing, Handed
from evaluation.run.front_ends import front_ends_for, truth_for
from evaluation.run.tracking import FRAMES_AHEAD, TrackingReport, TrackingTask, front_end_rng
from evaluation.setup.environment import prepare, settle
from evaluation.setup.memory import files_mib, peak_memory_mib
from evaluation.setup.setups import Setup
from evaluation.table.tracking_log import Tracked
from sim.interrupts import deaf_children, end_with_parent

NICENESS = 10
"""Where both have work, mapping goes first: it takes longer, and tracking fills the gaps."""


@dataclass(frozen=True)
class RobotReport:
    """What is known when all of a robot's images are tracked.

    Attributes:
        tracked: What its front end said.
        path: Its path as believed at last; None where it has none.
        processor_s, peak_memory_mib: Of the process, without what it shares with mapping: images
            under way, and libraries.
    """

    tracked: Tracked
    path: Trajectory | None
    processor_s: float
    peak_memory_mib: float


@dataclass(frozen=True)
class _Order:
    """A task as it crosses to another process, which opens the recording for itself."""

    recording: Path
    robot: Source
    setup: Setup
    seed: int
    drops: DropList


class RobotTrackingProcess:
    """Starts at once; the process imports the main module anew.

    Args:
        task: What to do; the recording must lie on disk.
        robot: Whose images to track.
    """

    def __init__(self, task: TrackingTask, robot: Source) -> None:
        # Spawned, not forked: OpenMP's threads do not survive a fork.
        context = multiprocessing.get_context("spawn")
        camera = task.recording.of(robot).calibration.camera
        self._ring = FrameRing(context, FRAMES_AHEAD, robot, camera.width * camera.height)
        self._pipe, theirs = context.Pipe()
        order = _Order(task.recording.path, robot, task.setup, task.seed, task.drops)
        name = f"airground-tracking-{robot.name.lower()}"
        self._process = context.Process(target=_track, args=(order, self._ring, theirs), name=name)
        with deaf_children():
            self._process.start()
        theirs.close()

    @property
    def pid(self) -> int:
        """Of the process."""
        assert self._process.pid is not None
        return self._process.pid

    def wait_until_ready(self) -> None:
        """Until everything there is compiled, and the first image could be tracked."""
        self._receive()

    def start(self) -> None:
        """Let it track, as far ahead as frames have room."""
        self._pipe.send(None)

    def frames(self) -> Iterator[TrackedFrame]:
        """A frame for each of the robot's images.

        Raises:
            AirgroundError: An image cannot be read, or the process died.
        """
        while isinstance(handed := self._receive(), Handed):
            yield self._ring.take(handed)

    def report(self) -> RobotReport:
        """To be asked when there are no more frames; raises as `frames` does."""
        report: RobotReport = self._receive()
        return report

    def end(self) -> None:
        """Nobody waits for it any more."""
        self._process.kill()
        self._process.join()
        self._pipe.close()

    def _receive(self) -> Any:
        try:
            answer = self._pipe.recv()
        except (EOFError, OSError):
            raise AirgroundError("tracking: its process died, perhaps for lack of memory") from None
        if isinstance(answer, AirgroundError):
            raise answer
        return answer


def _track(order: _Order, ring: FrameRing, pipe: Connection) -> None:
    """What the process does; what the user can mend is sent in place of an answer."""
    end_with_parent()
    os.nice(NICENESS)
    prepare(1)
    try:
        recording = Recording.open(order.recording)
        truth = truth_for(order.setup, order.recording)
        watched = front_ends_for(order.setup, recording, truth, front_end_rng(order.seed))
        calibration = recording.of(order.robot).calibration
        tracker = RobotTracker(order.robot, calibration, watched.of(order.robot))
        warm_up_slam(np.random.default_rng(0))
        settle()
        pipe.send(None)
        pipe.recv()
        started_s = time.process_time()
        for stamped in recording.messages(order.drops.dropped.by_robot(), (order.robot,)):
            frame = tracker.add(stamped.message)
            if frame is not None:
                ring.put(frame, pipe)
        pipe.send(None)
        path = tracker.finish()
        tracked = watched.tracked_by(order.robot)
        processor_s = time.process_time() - started_s
        memory_mib = peak_memory_mib() - ring.memory_mib - files_mib()
        pipe.send(RobotReport(tracked, path, processor_s, memory_mib))
    except AirgroundError as error:
        pipe.send(error)


class TrackingApart(AbstractContextManager["TrackingApart"]):
    """Tracks each robot in a process that ends with the block.

    The same frames and the same report as `TrackingHere`. The processes import the main module
    anew: a script that uses this keeps its work under `if __name__ == "__main__"`.

    Args:
        task: What to do; the recording must lie on disk.
    """

    def __init__(self, task: TrackingTask) -> None:
        self._processes = {robot: RobotTrackingProcess(task, robot) for robot in BOTH}

    @property
    def pids(self) -> list[int]:
        """Of the processes."""
        return [process.pid for process in self._processes.values()]

    def __exit__(self, *_: object) -> None:
        for process in self._processes.values():
            process.end()

    def wait_until_ready(self) -> None:
        """Until everything there is compiled, and the first image could be tracked."""
        for process in self._processes.values():
            process.wait_until_ready()

    def frames(self) -> Iterator[TrackedFrame]:
        """As `Tracking.frames`.

        Raises:
            AirgroundError: An image cannot be read, or a process died.
        """
        for process in self._processes.values():
            process.start()
        streams = [process.frames() for process in self._processes.values()]
        return heapq.merge(*streams, key=lambda frame: frame.stamp_ns)

    def report(self) -> TrackingReport:
        """As `Tracking.report`; raises as `frames` does."""
        reports = {robot: process.report() for robot, process in self._processes.items()}
        mav, ground = reports[Source.MAV], reports[Source.GROUND]
        return TrackingReport(
            {report.tracked.robot: report.tracked for report in (mav, ground)},
            ground.path,
            mav.processor_s + ground.processor_s,
            mav.peak_memory_mib + ground.peak_memory_mib,
        )

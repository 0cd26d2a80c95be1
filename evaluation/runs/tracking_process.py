"""Tracking in a process of its own, where Python's lock is not shared with mapping."""

from __future__ import annotations

import multiprocessing
import time
from collections.abc import Iterator
from contextlib import AbstractContextManager
from dataclasses import dataclass
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

from airground.core.cloud import Source
from airground.errors import AirgroundError
from airground.io.recording import Recording
from airground.tracking import TrackedFrame
from evaluation.environment import prepare, settle
from evaluation.protocol.experiment import peak_memory_mib
from evaluation.protocol.setups import Setup
from evaluation.realtime.drops import DropList
from evaluation.runs.frame_ring import FrameRing, Handed
from evaluation.runs.tracking import FRAMES_AHEAD, TrackingHere, TrackingReport, TrackingTask
from sim.interrupts import deaf_children, end_with_parent
from sim.truth import Truth


@dataclass(frozen=True)
class _Order:
    """A task as it crosses to another process, which opens the recording for itself."""

    recording: Path
    setup: Setup
    seed: int
    drops: DropList


class TrackingProcess(AbstractContextManager["TrackingProcess"]):
    """Tracks both robots in another process, which ends with the block.

    The same frames and the same report as `TrackingHere`. The process imports the main module
    anew: a script that uses this keeps its work under `if __name__ == "__main__"`.

    Args:
        task: What to do; the recording must lie on disk.
    """

    def __init__(self, task: TrackingTask) -> None:
        # Spawned, not forked: OpenMP's threads do not survive a fork.
        context = multiprocessing.get_context("spawn")
        cameras = [task.recording.calibration(robot).camera for robot in Source]
        pixels = max(camera.width * camera.height for camera in cameras)
        self._ring = FrameRing(context, FRAMES_AHEAD, pixels)
        self._pipe, theirs = context.Pipe()
        order = _Order(task.recording.path, task.setup, task.seed, task.drops)
        arguments = (order, self._ring, theirs)
        self._process = context.Process(target=_track, args=arguments, name="airground-tracking")
        with deaf_children():
            self._process.start()
        theirs.close()

    @property
    def pid(self) -> int:
        """Of the process."""
        assert self._process.pid is not None
        return self._process.pid

    def __exit__(self, *_: object) -> None:
        self._process.kill()
        self._process.join()
        self._pipe.close()

    def wait_until_ready(self) -> None:
        """Until everything there is compiled, and the first image could be tracked."""
        self._receive()

    def frames(self) -> Iterator[TrackedFrame]:
        """As `Tracking.frames`.

        Raises:
            AirgroundError: An image cannot be read, or the process died.
        """
        self._pipe.send(None)
        while isinstance(handed := self._receive(), Handed):
            yield self._ring.take(handed)

    def report(self) -> TrackingReport:
        """As `Tracking.report`; raises as `frames` does."""
        report: TrackingReport = self._receive()
        return report

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
    prepare(1)
    try:
        recording = Recording.open(order.recording)
        truth = Truth.open(order.recording)
        here = TrackingHere(TrackingTask(recording, truth, order.setup, order.seed, order.drops))
        here.wait_until_ready()
        settle()
        pipe.send(None)
        pipe.recv()
        started_s = time.process_time()
        for frame in here.in_turn():
            ring.put(frame, pipe)
        pipe.send(None)
        report = here.report()
        processor_s = time.process_time() - started_s
        memory_mib = peak_memory_mib() - ring.memory_mib
        pipe.send(TrackingReport(report.tracked, report.ground, processor_s, memory_mib))
    except AirgroundError as error:
        pipe.send(error)

"""Both robots' tracking beside mapping, each in a process of its own, as on the robots."""

from __future__ import annotations

import heapq
from collections.abc import Iterator
from contextlib import AbstractContextManager

from airground.core.cloud import Source
from airground.io.recording import BOTH
from airground.tracking import TrackedFrame
from evaluation.runs.robot_tracking_process import RobotTrackingProcess
from evaluation.runs.tracking import TrackingReport, TrackingTask


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

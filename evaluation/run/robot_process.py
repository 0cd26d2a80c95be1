"""One robot's tracking in a process of its own: the protocol between it and its parent.

The process opens the recording for itself, compiles, and sends `READY`. Its parent sends a start
order; then the process sends the answers of its task. An `AirgroundError` is sent in place of
an answer, and raised in the parent. The process ends when its parent ends.
"""

from __future__ import annotations

import multiprocessing
import os
from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import dataclass
from multiprocessing.connection import Connection
from multiprocessing.context import SpawnContext
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from airground.core.cloud import Source
from airground.errors import AirgroundError
from airground.io.recording import Recording
from airground.slam.warm_up import warm_up_slam
from airground.tracking import RobotTracker
from evaluation.run.front_ends import WatchedFrontEnds, front_ends_for, truth_for
from evaluation.run.tracking import front_end_rng
from evaluation.setup.environment import prepare
from evaluation.setup.setups import Setup
from sim.interrupts import deaf_children, end_with_parent

READY = None
"""Answer of a process that waits for its start order."""

Order = TypeVar("Order")


@dataclass(frozen=True)
class RobotTask:
    """One robot's tracking, as sent to its process; the setup chooses the front end."""

    recording: Path
    robot: Source
    setup: Setup
    seed: int


class RobotProcess(AbstractContextManager["RobotProcess"]):
    """A process that starts at once, is killed when the block ends, and ignores Ctrl-C.

    Processes are spawned, since threads of OpenMP do not survive a fork: each imports the main
    module anew, so a script that uses this keeps its work under `if __name__ == "__main__"`.

    Args:
        robot: The robot to track.
        serve: The body of the process; a function of a module.
        order: First argument of `serve`; the pipe to the parent follows.
        context: Source of processes and of memory that they share.
    """

    def __init__(
        self,
        robot: Source,
        serve: Callable[[Order, Connection], None],
        order: Order,
        context: SpawnContext | None = None,
    ) -> None:
        context = context or multiprocessing.get_context("spawn")
        self._pipe, theirs = context.Pipe()
        self._name = f"airground-{robot.name.lower()}"
        self._process = context.Process(
            target=_serve, args=(serve, order, theirs), name=self._name, daemon=True
        )
        with deaf_children():
            self._process.start()
        theirs.close()

    @property
    def pid(self) -> int:
        """Identifier of the process."""
        assert self._process.pid is not None
        return self._process.pid

    def is_alive(self) -> bool:
        """Whether the process still runs."""
        return self._process.is_alive()

    def wait_until_ready(self) -> None:
        """Return when the process has compiled and could track the first image; raises
        AirgroundError if the task is refused, or the process died."""
        self.receive()

    def start(self, order: object = None) -> None:
        """Send the start order; raises AirgroundError if the process died."""
        try:
            self._pipe.send(order)
        except OSError:
            raise self._died() from None

    def receive(self, or_none: bool = False) -> Any:
        """The next answer; None with `or_none` if the process died. Raises AirgroundError if the
        process could not go on, or died."""
        try:
            answer = self._pipe.recv()
        except (EOFError, OSError):
            if or_none:
                return None
            raise self._died() from None
        if isinstance(answer, AirgroundError):
            raise answer
        return answer

    def answers_within(self, seconds: float) -> bool:
        """Whether an answer, or the end of the process, comes within this time [s]."""
        return self._pipe.poll(seconds)

    def _died(self) -> AirgroundError:
        return AirgroundError(f"{self._name}: its process died, perhaps for lack of memory")

    def __exit__(self, *_: object) -> None:
        self._process.kill()
        self._process.join()
        self._pipe.close()


def _serve(serve: Callable[[Order, Connection], None], order: Order, pipe: Connection) -> None:
    end_with_parent()
    prepare(1)
    try:
        serve(order, pipe)
    except AirgroundError as error:
        pipe.send(error)


def open_tracker(
    task: RobotTask, niceness: int = 0
) -> tuple[Recording, WatchedFrontEnds, RobotTracker]:
    """The recording, the front ends and one robot's tracker, compiled, in the robot's process.

    `niceness` is added to that of the process.

    Raises:
        AirgroundError: The recording or its truth is missing or damaged.
    """
    os.nice(niceness)
    recording = Recording.open(task.recording)
    truth = truth_for(task.setup, task.recording)
    watched = front_ends_for(task.setup, recording, truth, front_end_rng(task.seed))
    calibration = recording.of(task.robot).calibration
    tracker = RobotTracker(task.robot, calibration, watched.of(task.robot))
    if task.robot.name.lower() in task.setup.slam_robots():
        warm_up_slam(np.random.default_rng(0), (task.robot,))
    return recording, watched, tracker

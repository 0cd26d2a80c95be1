"""A tracker's process as its parent sees it: it may refuse, die or fall silent."""

from __future__ import annotations

import multiprocessing
from multiprocessing.connection import wait

from airground.errors import AirgroundError
from airground.link.channel import Receiver
from evaluation.realtime.arrivals import Stream
from evaluation.realtime.clock import PlaybackClock
from evaluation.realtime.tracker_process import TrackerReport, TrackerTask, live
from sim.interrupts import deaf_children

REPORT_S = 30.0
"""A robot that has sent all its frames may take so long to report."""


class RobotProcess:
    """Starts at once, in the background, deaf to Ctrl-C.

    Args:
        task: What the robot is to do.
        receiver: Where its frames come in.

    Attributes:
        robot: Which one it is.
        stream: What it sends to the mapper.
    """

    def __init__(self, task: TrackerTask, receiver: Receiver) -> None:
        # Spawned, not forked: OpenMP's threads and sockets do not survive a fork.
        context = multiprocessing.get_context("spawn")
        self._pipe, theirs = context.Pipe()
        name = f"airground-{task.robot.name.lower()}"
        self._process = context.Process(target=live, args=(task, theirs), name=name, daemon=True)
        with deaf_children():
            self._process.start()
        theirs.close()
        self._receiver = receiver
        self.robot = task.robot
        self.stream = Stream(receiver, self._process.is_alive)

    def wait_until_ready(self) -> None:
        """Until everything is compiled and the first image could come.

        Raises:
            AirgroundError: It refused its task, or died.
        """
        wait([self._pipe, self._process.sentinel])
        try:
            answer = self._pipe.recv()
        except EOFError:
            raise AirgroundError(f"{self._name}: its process died before the start") from None
        if answer is not None:
            raise answer

    def start(self, clock: PlaybackClock) -> None:
        """Let it live, by this clock."""
        self._pipe.send(clock)

    def report(self) -> TrackerReport | None:
        """What it has to tell; None where it died or fell silent.

        Raises:
            AirgroundError: It could not go on, as where an image cannot be read.
        """
        try:
            answer = self._pipe.recv() if self._pipe.poll(REPORT_S) else None
        except (EOFError, OSError):
            return None
        if isinstance(answer, AirgroundError):
            raise answer
        return answer

    def end(self) -> None:
        """Nobody waits for it any more."""
        self._process.kill()
        self._process.join()
        self._pipe.close()
        self._receiver.close()

    @property
    def _name(self) -> str:
        return self.robot.name.lower()

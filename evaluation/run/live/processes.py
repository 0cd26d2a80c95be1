"""One robot's tracking process in a live run, from inside and as its parent sees it."""

from __future__ import annotations

import importlib
import multiprocessing
import os
import threading
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from pathlib import Path

import numpy as np

from airground.core.cloud import Source
from airground.core.trajectory import Trajectory
from airground.errors import AirgroundError
from airground.io.recording import Recording
from airground.link.channel import Receiver, Sender
from airground.slam.warm_up import warm_up_slam
from airground.tracking import RobotTracker
from evaluation.run.front_ends import front_ends_for, truth_for
from evaluation.run.live.arrivals import Stream
from evaluation.run.live.playback import PlaybackClock
from evaluation.run.live.player import Played, play
from evaluation.run.live.radio_link import Radio, RadioLimits, Uplink
from evaluation.run.tracking import front_end_rng
from evaluation.setup.environment import prepare, settle
from evaluation.setup.memory import peak_memory_mib
from evaluation.setup.setups import Setup
from evaluation.table.tracking_log import FrontEndLog
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


@dataclass(frozen=True)
class TrackerTask:
    """What a robot is to do.

    Attributes:
        recording: Where its recording is.
        robot: Which one it is.
        setup, seed: As in a run offline.
        waiting_frames: How many images may wait before its tracker.
        frames_under_way: How many frames the mapper may still have before it.
        radio: What lies between it and the mapper, None for one computer.
        address: Where the mapper listens.
    """

    recording: Path
    robot: Source
    setup: Setup
    seed: int
    waiting_frames: int
    frames_under_way: int
    radio: RadioLimits | None
    address: str


@dataclass(frozen=True)
class TrackerReport:
    """What a robot tells when all is over.

    Attributes:
        log, final: What its front end said, image by image and at last.
        played: How it lived through the recording.
        shed_ns, lost_ns: Stamps of frames for which the mapper had no room, and of those
            that the radio lost.
        sent_bytes: How much it sent.
        most_under_way: The most frames that the mapper ever had before it.
        peak_memory_mib: The most memory that the process held.
    """

    log: FrontEndLog
    final: Trajectory | None
    played: Played
    shed_ns: list[int]
    lost_ns: list[int]
    sent_bytes: int
    most_under_way: int
    peak_memory_mib: float


def live(task: TrackerTask, pipe: Connection) -> None:
    """What the process does: says None when it is ready, is told the clock, and reports.

    What the user can mend is sent in place of an answer.
    """
    threading.Thread(target=_end_with_parent, daemon=True).start()
    prepare(1)
    try:
        pipe.send(_report(task, pipe))
    except AirgroundError as error:
        pipe.send(error)


def _report(task: TrackerTask, pipe: Connection) -> TrackerReport:
    recording = Recording.open(task.recording)
    truth = truth_for(task.setup, task.recording)
    watched = front_ends_for(task.setup, recording, truth, front_end_rng(task.seed))
    tracker = RobotTracker(task.robot, recording.of(task.robot).calibration, watched.of(task.robot))
    if task.robot.name.lower() in task.setup.slam_robots():
        warm_up_slam(np.random.default_rng(0))
        # SLAM loads it when a loop closes; here nobody can wait for that.
        importlib.import_module("open3d")
    settle()
    radio = None
    if task.radio is not None:
        radio = Radio(task.radio, np.random.default_rng([task.seed, 1]))
    sender = Sender(task.address, task.frames_under_way)
    uplink = Uplink(sender, radio, task.radio.jpeg_quality if task.radio else None)
    pipe.send(None)
    clock: PlaybackClock = pipe.recv()
    played = play(recording, task.robot, tracker, clock, task.waiting_frames, uplink.offer)
    final = tracker.finish()
    uplink.close(final)
    return TrackerReport(
        watched.of(task.robot).log(),
        final,
        played,
        uplink.shed,
        uplink.lost,
        uplink.sent_bytes,
        sender.most_under_way,
        peak_memory_mib(),
    )


def _end_with_parent() -> None:
    """Nobody is left alone when the process that started it is killed."""
    parent = multiprocessing.parent_process()
    assert parent is not None
    wait([parent.sentinel])
    os._exit(1)

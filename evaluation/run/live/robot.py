"""One robot of a live run, in a process of its own: camera, inertial sensor, tracking, uplink."""

from __future__ import annotations

import importlib
from dataclasses import dataclass
from multiprocessing.connection import Connection

import numpy as np

from airground.core.trajectory import Trajectory
from airground.link.channel import Sender
from evaluation.run.live.playback import PlaybackClock, Played, play
from evaluation.run.live.radio_link import Radio, RadioLimits, Uplink
from evaluation.run.robot_process import READY, RobotTask, open_tracker
from evaluation.setup.environment import settle
from evaluation.setup.memory import peak_memory_mib
from evaluation.table.tracking_log import FrontEndLog


@dataclass(frozen=True)
class LiveTask:
    """One robot's part of a live run.

    Attributes:
        task: Recording, robot, front end and seed.
        waiting_frames: Images that may wait before the tracker.
        frames_under_way: Frames that may wait before the mapper.
        radio: Limits of the radio to the mapper; None on one computer.
        address: Address at which the mapper listens.
    """

    task: RobotTask
    waiting_frames: int
    frames_under_way: int
    radio: RadioLimits | None
    address: str


@dataclass(frozen=True)
class RobotReport:
    """Outcome of one robot's live run.

    Attributes:
        log: Answers of its front end, image by image.
        final: Its final trajectory; None where it has none.
        played: Outcome of the playback.
        shed_ns: Stamps of frames for which the mapper had no room [ns].
        lost_ns: Stamps of frames that the radio lost [ns].
        sent_bytes: Size of all frames sent, lost ones included.
        most_under_way: Largest number of frames that waited before the mapper.
        peak_memory_mib: Peak memory of the process [MiB].
    """

    log: FrontEndLog
    final: Trajectory | None
    played: Played
    shed_ns: list[int]
    lost_ns: list[int]
    sent_bytes: int
    most_under_way: int
    peak_memory_mib: float


def play_robot(order: LiveTask, pipe: Connection) -> None:
    """Body of the process: sends `READY`, receives the clock, plays, and sends a `RobotReport`."""
    task = order.task
    recording, watched, tracker = open_tracker(task)
    if task.robot.name.lower() in task.setup.slam_robots():
        # Imported here, since SLAM's import at its first closed loop would delay live poses.
        importlib.import_module("open3d")
    settle()
    radio = Radio(order.radio or RadioLimits(), np.random.default_rng([task.seed, 1]))
    sender = Sender(order.address, order.frames_under_way)
    uplink = Uplink(sender, radio, order.radio.jpeg_quality if order.radio else None)
    pipe.send(READY)
    clock: PlaybackClock = pipe.recv()
    played = play(recording, task.robot, tracker, clock, order.waiting_frames, uplink.offer)
    final = tracker.finish()
    uplink.close(final)
    report = RobotReport(
        log=watched.of(task.robot).log(),
        final=final,
        played=played,
        shed_ns=uplink.shed,
        lost_ns=uplink.lost,
        sent_bytes=radio.carried_bytes,
        most_under_way=sender.most_under_way,
        peak_memory_mib=peak_memory_mib(),
    )
    pipe.send(report)

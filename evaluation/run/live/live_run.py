"""A live run: two trackers in processes of their own, the mapper in this one."""

from __future__ import annotations

import os
import time
from collections.abc import Iterable, Iterator
from contextlib import ExitStack

import numpy as np

from airground.core.cloud import Source
from airground.core.events import Aligned
from airground.io.recording import Recording
from airground.link.channel import Receiver
from airground.tracking import TrackedFrame
from airground.warm_up import warm_up_mapping
from evaluation.run.drops import DropList
from evaluation.run.live.arrivals import in_order
from evaluation.run.live.outcome import Lived, add_live_rows
from evaluation.run.live.playback import Playback, PlaybackClock
from evaluation.run.live.processes import RobotProcess, TrackerTask
from evaluation.run.onlooker import timed
from evaluation.run.recording import Measure, RunResult
from evaluation.setup.environment import settle
from evaluation.setup.memory import peak_memory_mib
from evaluation.setup.progress import step
from evaluation.setup.setups import Setup
from evaluation.table.tracking_log import FrontEndLog, Tracked
from sim.recording.truth import Truth

START_NS = 300_000_000
"""From the moment when everybody is ready to the first image."""

MAPPER_NICENESS = 5


def run_live(
    recording: Recording, truth: Truth, setup: Setup, seed: int, playback: Playback
) -> tuple[RunResult, DropList]:
    """Play a recording by its own clock through the pipeline.

    Each robot tracks in a process of its own and sends its frames over a loopback socket; the
    mapper, in this process, takes them in order of time. No tracker waits for the mapper.

    Args:
        recording, truth, setup, seed: As in a run offline.
        playback: How fast, how much may wait, and through which radio.

    Returns:
        What a run offline leaves, with the rows of `add_live_rows`; and the list with which
        a run offline gives the same.

    Raises:
        AirgroundError: A robot's process refused its task, or could not go on.
    """
    measure = Measure(recording, truth, setup, seed)
    images = sum(len(recording.of(robot).camera_stamps) for robot in Source)
    with ExitStack() as stack, step("playing", images, "images") as playing:
        robots = [
            _start(recording, robot, setup, seed, playback, stack)
            for robot in (Source.GROUND, Source.MAV)
        ]
        _step_back()
        warm_up_mapping(setup.config, np.random.default_rng(0))
        settle()
        for robot in robots:
            robot.wait_until_ready()
        lived = Lived(_clock(recording, playback.rate))
        for robot in robots:
            robot.start(lived.clock)
        streams = {robot.robot: robot.stream for robot in robots}
        patience_s = playback.patience_s
        if playback.radio is not None:
            patience_s += playback.radio.latency_ms * 1e-3
        frames = in_order(streams, lived.clock, patience_s)
        _map(measure, playing.along(frames), lived)
        for robot in robots:
            lived.reports[robot.robot] = robot.report()
            lived.late_ns[robot.robot] = robot.stream.late_ns
        measure.pipeline.mapping.correct_ground(streams[Source.GROUND].final)
    add_live_rows(measure.out, recording, lived, playback)
    return measure.result(_tracked(lived, setup)), lived.drops(recording, playback.jpeg_quality)


def _step_back() -> None:
    """Let the trackers, which have started, go first where there are too few cores."""
    own = os.getpriority(os.PRIO_PROCESS, 0)
    os.setpriority(os.PRIO_PROCESS, 0, max(own, MAPPER_NICENESS))


def _start(
    recording: Recording,
    robot: Source,
    setup: Setup,
    seed: int,
    playback: Playback,
    stack: ExitStack,
) -> RobotProcess:
    receiver = Receiver()
    task = TrackerTask(
        recording.path,
        robot,
        setup,
        seed,
        playback.waiting_frames,
        playback.frames_under_way,
        playback.radio if robot == Source.MAV else None,
        receiver.address,
    )
    process = RobotProcess(task, receiver)
    stack.callback(process.end)
    return process


def _clock(recording: Recording, rate: float) -> PlaybackClock:
    first_ns = min(int(recording.of(robot).camera_stamps[0]) for robot in Source)
    return PlaybackClock(first_ns, time.monotonic_ns() + START_NS, rate)


def _map(measure: Measure, frames: Iterable[TrackedFrame], lived: Lived) -> None:
    """Take in all frames, and note when each was done with."""
    before_s = time.process_time()
    for event, duration_ms in timed(measure.pipeline.run(_noted(frames, lived))):
        if isinstance(event, Aligned):
            now_ns = lived.clock.now_ns()
            lived.aligned_ms.append(lived.clock.passed_ms(event.stamp_ns, now_ns))
        measure.take(event, duration_ms)
    lived.wall_s = (time.monotonic_ns() - lived.clock.started_ns) * 1e-9
    lived.processor_s = time.process_time() - before_s
    lived.peak_memory_mib = peak_memory_mib()


def _noted(frames: Iterable[TrackedFrame], lived: Lived) -> Iterator[TrackedFrame]:
    for frame in frames:
        yield frame
        lived.mapped_ns[frame.robot][frame.stamp_ns] = lived.clock.now_ns()


def _tracked(lived: Lived, setup: Setup) -> dict[str, Tracked]:
    """What the front ends said; nothing where nobody lived to tell."""
    tracked = {}
    for robot, report in lived.reports.items():
        name = robot.name.lower()
        log, final = (report.log, report.final) if report else (FrontEndLog(), None)
        tracked[name] = Tracked(name, log, final, name in setup.slam_robots())
    return tracked

"""A live run: two trackers in processes of their own, the mapper in this one.

Each robot tracks in its process and sends its frames over a loopback socket. The mapper takes
them in order of time. No tracker waits for the mapper.
"""

from __future__ import annotations

import os
import time
from collections.abc import Iterator
from contextlib import AbstractContextManager, ExitStack

from airground.core.cloud import Source
from airground.core.events import Aligned
from airground.io.recording import Recording
from airground.io.robot_recording import BOTH
from airground.link.channel import Receiver
from airground.tracking import TrackedFrame
from evaluation.run.driver import drive, pipeline_for
from evaluation.run.drops import DropList
from evaluation.run.live.arrivals import Stream, in_order
from evaluation.run.live.outcome import Lived, add_live_rows
from evaluation.run.live.playback import Playback, PlaybackClock
from evaluation.run.live.robot import LiveTask, RobotReport, play_robot
from evaluation.run.onlooker import Onlooker, Seen
from evaluation.run.recording import RunResult, RunRows
from evaluation.run.robot_process import RobotProcess, RobotTask
from evaluation.run.tracking import TrackingReport, localizer_rng
from evaluation.setup.memory import peak_memory_mib
from evaluation.setup.setups import Setup
from evaluation.table.tracking_log import FrontEndLog, Tracked
from sim.recording.truth import Truth

START_NS = 300_000_000
"""Time from the start order to the first image: the order reaches both processes by then."""

MAPPER_NICENESS = 5
"""Priority that the mapper gives up for the trackers, where there are too few cores."""

REPORT_S = 30.0
"""Time that a robot may take to report after its last frame."""


def run_live(
    recording: Recording,
    truth: Truth,
    setup: Setup,
    seed: int,
    playback: Playback,
    onlookers: tuple[Onlooker, ...] = (),
) -> tuple[RunResult, DropList]:
    """Play a recording at its own rate through the pipeline.

    Args:
        recording, truth, setup, seed: As in `run_recording`.
        playback: Rate, sizes of the queues, and the radio.
        onlookers: Consumers of every event; their time delays the mapper.

    Returns:
        The result of a run, with the rows of `add_live_rows`; and the list of drops with which
        a run offline gives the same result.

    Raises:
        AirgroundError: A robot's process refused its task, or could not go on.
    """
    rows = RunRows(recording, truth, setup)
    pipeline = pipeline_for(recording, setup, localizer_rng(seed, recording.flight))
    with LiveTracking(recording, setup, seed, playback) as tracking:
        driven = drive(recording, tracking, pipeline, setup, [tracking, rows, *onlookers])
        lived = tracking.lived
    add_live_rows(rows.out, recording, lived, playback)
    result = rows.result(driven.tracked, pipeline.augmented_map())
    return result, lived.drops(recording, playback.jpeg_quality)


class LiveTracking(AbstractContextManager["LiveTracking"]):
    """Both robots' tracking in a live run; also an onlooker that notes when surfaces are aligned.

    Args:
        recording: Recording on disk.
        setup: Choice of the front ends.
        seed: Seed of the front ends and of the radio.
        playback: Rate, sizes of the queues, and the radio.

    Attributes:
        lived: Times, drops and reports, known after the last frame.
    """

    lived: Lived

    def __init__(self, recording: Recording, setup: Setup, seed: int, playback: Playback) -> None:
        self._recording, self._setup, self._seed = recording, setup, seed
        self._playback = playback
        self._processes: dict[Source, RobotProcess] = {}
        self._streams: dict[Source, Stream] = {}
        with ExitStack() as stack:
            for robot in BOTH:
                self._start(robot, stack)
            self._stack = stack.pop_all()
        own = os.getpriority(os.PRIO_PROCESS, 0)
        os.setpriority(os.PRIO_PROCESS, 0, max(own, MAPPER_NICENESS))

    def _start(self, robot: Source, stack: ExitStack) -> None:
        playback, receiver = self._playback, Receiver()
        stack.callback(receiver.close)
        order = LiveTask(
            RobotTask(self._recording.path, robot, self._setup, self._seed),
            playback.waiting_frames,
            playback.frames_under_way,
            playback.radio if robot == Source.MAV else None,
            receiver.address,
        )
        process = stack.enter_context(RobotProcess(robot, play_robot, order))
        self._processes[robot] = process
        self._streams[robot] = Stream(receiver, process.is_alive)

    def __exit__(self, *_: object) -> None:
        self._stack.close()

    def wait_until_ready(self) -> None:
        """As `Tracking.wait_until_ready`."""
        for process in self._processes.values():
            process.wait_until_ready()

    def frames(self) -> Iterator[TrackedFrame]:
        """As `Tracking.frames`, at the recording's own rate."""
        playback, recording = self._playback, self._recording
        first_ns = min(int(recording.of(robot).camera_stamps[0]) for robot in Source)
        clock = PlaybackClock(first_ns, time.monotonic_ns() + START_NS, playback.rate)
        self.lived = lived = Lived(clock)
        for process in self._processes.values():
            process.start(clock)
        patience_s = playback.patience_s
        if playback.radio is not None:
            patience_s += playback.radio.latency_ms * 1e-3
        self._processor_s = time.process_time()
        for frame in in_order(self._streams, clock, patience_s):
            yield frame
            lived.mapped_ns[frame.robot][frame.stamp_ns] = clock.now_ns()

    def see(self, seen: Seen) -> None:
        """Note the time from a surface's last image to its place in the ground map."""
        if isinstance(seen.event, Aligned):
            clock = self.lived.clock
            self.lived.aligned_ms.append(clock.passed_ms(seen.event.stamp_ns, clock.now_ns()))

    def report(self) -> TrackingReport:
        """As `Tracking.report`; a robot whose process died has no answers."""
        lived = self.lived
        lived.wall_s = (time.monotonic_ns() - lived.clock.started_ns) * 1e-9
        lived.processor_s = time.process_time() - self._processor_s
        lived.peak_memory_mib = peak_memory_mib()
        tracked = {}
        for robot, process in self._processes.items():
            report = _report_of(process)
            lived.reports[robot] = report
            lived.late_ns[robot] = self._streams[robot].late_ns
            name = robot.name.lower()
            log, final = (report.log, report.final) if report else (FrontEndLog(), None)
            tracked[name] = Tracked(name, log, final, name in self._setup.slam_robots())
        return TrackingReport(tracked, self._streams[Source.GROUND].final)


def _report_of(process: RobotProcess) -> RobotReport | None:
    """A robot's report; None where its process died or does not answer.

    Raises:
        AirgroundError: The robot could not go on, as where an image cannot be read.
    """
    if not process.answers_within(REPORT_S):
        return None
    report: RobotReport | None = process.receive(or_none=True)
    return report

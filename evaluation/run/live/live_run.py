"""A live run: two trackers in processes of their own, the mapper in this one.

Each robot tracks in its process and sends its frames over a socket of this user alone. The mapper
takes them in order of time. No tracker waits for the mapper.
"""

from __future__ import annotations

import logging
import time
from collections.abc import Iterator, Mapping
from contextlib import AbstractContextManager, ExitStack
from dataclasses import dataclass, field, replace

from airground.core.cloud import Source
from airground.core.events import Aligned
from airground.io.recording import Recording
from airground.io.robot_recording import BOTH
from airground.link.channel import Receiver
from airground.tracking import TrackedFrame
from evaluation.run.claim_log import ClaimLog
from evaluation.run.driver import drive, pipeline_for
from evaluation.run.drops import SCHEMA, DropList, Stamps, fingerprint
from evaluation.run.live.arrivals import Stream, in_order
from evaluation.run.live.playback import LiveTask, Playback, PlaybackClock, RobotReport, play_robot
from evaluation.run.live.priority import lowest_priority
from evaluation.run.live.stamped_times import StampedTimes
from evaluation.run.onlooker import Seen
from evaluation.run.recording import RunResult, RunRows
from evaluation.run.robot_process import RobotProcess, RobotTask
from evaluation.run.tracking import TrackingReport, localizer_rng
from evaluation.setup.memory import peak_memory_mib
from evaluation.setup.setups import Setup
from evaluation.table.row_writer import RowWriter
from evaluation.table.rows import LIVE_STAGE
from evaluation.table.tracking_log import FrontEndLog, Tracked
from sim.recording.truth import Truth

START_NS = 300_000_000
"""Time from the start order to the first image [ns]: the order reaches both processes by then."""

REPORT_S = 30.0
"""Longest wait for a robot's report after its last frame [s]."""

logger = logging.getLogger(__name__)


@dataclass
class LiveLog:
    """Times, drops and reports of a live run.

    Attributes:
        clock: Clock of the playback.
        reports: Report of each robot; None if its process died.
        late_ns: Stamps of each robot's frames that were late for the mapper [ns].
        mapped_ns: Time at which the mapper finished each frame, by robot and stamp [ns].
        aligned_ms: Time from each surface's last image to its place in the ground map [ms].
        processor_s: Processor time of the mapper [s].
        peak_memory_mib: Peak memory of the mapper [MiB].
        wall_s: Time from the first image to the last event [s].
    """

    clock: PlaybackClock
    reports: dict[Source, RobotReport | None] = field(default_factory=dict)
    late_ns: dict[Source, list[int]] = field(default_factory=dict)
    mapped_ns: dict[Source, StampedTimes] = field(
        default_factory=lambda: {robot: StampedTimes() for robot in Source}
    )
    aligned_ms: list[float] = field(default_factory=list)
    processor_s: float = 0.0
    peak_memory_mib: float = 0.0
    wall_s: float = 0.0

    def drops(self, recording: Recording, jpeg_quality: int | None) -> DropList:
        """The drop list with which a run offline gives the same result."""
        dropped, unmapped = {}, {}
        for robot, report in self.reports.items():
            name = robot.name.lower()
            if report is None:
                # Which images the process tracked is unknown: only mapped ones are kept.
                stamps = set(recording.of(robot).camera_stamps.tolist())
                dropped[name] = frozenset(stamps - self.mapped_ns[robot].keys())
                continue
            dropped[name] = frozenset(report.played.dropped_ns)
            unmapped[name] = frozenset((*report.shed_ns, *report.lost_ns, *self.late_ns[robot]))
        return DropList(
            schema=SCHEMA,
            recording=fingerprint(recording),
            dropped=Stamps(**dropped),
            unmapped=Stamps(**unmapped),
            jpeg_quality=jpeg_quality,
        )


def run_live(
    recording: Recording, truth: Truth, setup: Setup, seed: int, playback: Playback
) -> tuple[RunResult, DropList]:
    """Play a recording at its own rate through the pipeline, otherwise as `run_recording`.

    Returns:
        The result of a run, with the rows of `add_live_rows` and the claims as they were made; and
        the drop list with which a run offline gives the same result, but claims without delay.

    Raises:
        AirgroundError: A robot's process refused its task, or could not go on.
    """
    rows = RunRows(recording, truth, setup)
    pipeline = pipeline_for(recording, setup, localizer_rng(seed, recording.flight))
    with LiveTracking(recording, setup, seed, playback) as tracking:
        claims = ClaimLog(tracking.recorded_now_ns)
        driven = drive(recording, tracking, pipeline, setup, [tracking, rows, claims])
        log = tracking.log
    add_live_rows(rows.out, recording, log, playback)
    result = rows.result(driven.tracked, pipeline.augmented_map())
    result = replace(result, claims=claims.claims(driven.tracked))
    return result, log.drops(recording, playback.jpeg_quality)


class LiveTracking(AbstractContextManager["LiveTracking"]):
    """Both robots' tracking in a live run; also an onlooker that notes when surfaces are aligned.

    Args:
        recording: Recording on disk.
        setup: Choice of the front ends.
        seed: Seed of the front ends and of the radio.
        playback: Rate, sizes of the queues, and the radio.

    Attributes:
        log: Times, drops and reports; complete after `report`.
    """

    log: LiveLog

    def __init__(self, recording: Recording, setup: Setup, seed: int, playback: Playback) -> None:
        self._recording, self._setup, self._seed = recording, setup, seed
        self._playback = playback
        self._processes: dict[Source, RobotProcess] = {}
        self._streams: dict[Source, Stream] = {}
        with ExitStack() as stack:
            for robot in BOTH:
                self._start(robot, stack)
            # Not before: the trackers would inherit it.
            stack.enter_context(lowest_priority())
            self._stack = stack.pop_all()

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
        self.log = log = LiveLog(clock)
        for process in self._processes.values():
            process.start(clock)
        logger.debug("both robots play")
        patience_s = playback.patience_s
        if playback.radio is not None:
            patience_s += playback.radio.latency_ms * 1e-3
        self._processor_s = time.process_time()
        for frame in in_order(self._streams, clock, patience_s):
            yield frame
            log.mapped_ns[frame.robot].note(frame.stamp_ns, clock.now_ns())

    def see(self, seen: Seen) -> None:
        """Note the time from a surface's last image to its place in the ground map."""
        if isinstance(seen.event, Aligned):
            clock = self.log.clock
            self.log.aligned_ms.append(clock.passed_ms(seen.event.stamp_ns, clock.now_ns()))

    def recorded_now_ns(self, _: Seen) -> int:
        """Recorded time that it is now [ns]: what is claimed holds for images from now on."""
        return self.log.clock.now_ns()

    def report(self) -> TrackingReport:
        """As `Tracking.report`; a robot whose process died has no answers."""
        log = self.log
        log.wall_s = (time.monotonic_ns() - log.clock.started_ns) * 1e-9
        log.processor_s = time.process_time() - self._processor_s
        log.peak_memory_mib = peak_memory_mib()
        tracked = {}
        for robot, process in self._processes.items():
            report = _report_of(process)
            log.reports[robot] = report
            log.late_ns[robot] = self._streams[robot].late_ns
            name, malformed = robot.name.lower(), self._streams[robot].malformed
            if report is None:
                logger.warning(
                    "%s: its process died or fell silent; what is left is without its trajectory",
                    name,
                )
            if malformed:
                logger.warning("%s: dropped messages that were malformed: %d", name, malformed)
            answers, final = (report.log, report.final) if report else (FrontEndLog(), None)
            tracked[name] = Tracked(name, answers, final, name in self._setup.slam_robots())
        return TrackingReport(tracked, self._streams[Source.GROUND].final)


def _report_of(process: RobotProcess) -> RobotReport | None:
    """A robot's report, None if its process died or does not answer; raises AirgroundError if the
    robot cannot read an image."""
    if not process.answers_within(REPORT_S):
        return None
    report: RobotReport | None = process.receive(or_none=True)
    return report


def add_live_rows(out: RowWriter, recording: Recording, log: LiveLog, playback: Playback) -> None:
    """Write the latencies, drops and resources of a live run.

    A latency counts from the moment when an image was due: `*_posed_ms` to its pose,
    `*_mapped_ms` to the end of the mapper's work on it, `aligned_ms` from the last image of an
    aerial surface to the surface's place in the ground map.
    """
    for robot, report in log.reports.items():
        name = robot.name.lower()
        _add_latencies(out, f"{name}_mapped_ms", log.clock, log.mapped_ns[robot])
        out.add(LIVE_STAGE, f"{name}_late", len(log.late_ns[robot]), "")
        if report is None:
            out.add(LIVE_STAGE, f"{name}_survived", 0.0, "", note="its process died or fell silent")
        else:
            out.add(LIVE_STAGE, f"{name}_survived", 1.0, "")
            _add_report(out, name, report, log)
    for latency_ms in log.aligned_ms:
        out.add(LIVE_STAGE, "aligned_ms", latency_ms, "ms")
    out.add(LIVE_STAGE, "rate", playback.rate, "")
    out.add(LIVE_STAGE, "recorded_s", recording.duration_s, "s")
    out.add(LIVE_STAGE, "wall_s", log.wall_s, "s")
    out.add(LIVE_STAGE, "mapper_processor_share", log.processor_s / log.wall_s, "")
    out.add(LIVE_STAGE, "mapper_peak_memory_mib", log.peak_memory_mib, "MiB")


def _add_report(out: RowWriter, name: str, report: RobotReport, log: LiveLog) -> None:
    played = report.played
    _add_latencies(out, f"{name}_posed_ms", log.clock, played.posed_ns)
    for metric, value, unit in (
        ("images", len(played.posed_ns) + len(played.dropped_ns), ""),
        ("dropped", len(played.dropped_ns), ""),
        ("shed", len(report.shed_ns), ""),
        ("lost", len(report.lost_ns), ""),
        ("longest_queue", played.longest_queue, ""),
        ("most_under_way", report.most_under_way, ""),
        ("sent_bytes", report.sent_bytes, "B"),
        ("processor_share", played.processor_s / log.wall_s, ""),
        ("peak_memory_mib", report.peak_memory_mib, "MiB"),
    ):
        out.add(LIVE_STAGE, f"{name}_{metric}", value, unit)


def _add_latencies(
    out: RowWriter, metric: str, clock: PlaybackClock, done_ns: Mapping[int, int]
) -> None:
    for stamp_ns, at_ns in done_ns.items():
        time_s = (stamp_ns - clock.first_ns) * 1e-9
        out.add(LIVE_STAGE, metric, clock.passed_ms(stamp_ns, at_ns), "ms", time_s=time_s)

"""What a live run leaves beside its result: dropped frames, latencies, and rows of both."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from airground.core.cloud import Source
from airground.io.recording import Recording
from evaluation.run.drops import SCHEMA, DropList, Stamps, fingerprint
from evaluation.run.live.playback import Playback, PlaybackClock
from evaluation.run.live.robot import RobotReport
from evaluation.table.row_writer import RowWriter
from evaluation.table.rows import LIVE_STAGE


@dataclass
class Lived:
    """What a live run leaves beside its result.

    Attributes:
        clock: What time it was.
        reports: Of each robot; None where its process did not live to tell.
        late_ns: Stamps of frames that came after the mapper had gone on without them.
        received_ns: Stamps of the frames that the mapper got.
        mapped_ns: For each of those: when the mapper was done with it.
        aligned_ms: For each surface: from its last image to its place in the ground map [ms].
        processor_s: Processor time of the mapper.
        peak_memory_mib: The most memory that the mapper held.
        wall_s: From the first image to the last event.
    """

    clock: PlaybackClock
    reports: dict[Source, RobotReport | None] = field(default_factory=dict)
    late_ns: dict[Source, list[int]] = field(default_factory=dict)
    mapped_ns: dict[Source, dict[int, int]] = field(
        default_factory=lambda: {robot: {} for robot in Source}
    )
    aligned_ms: list[float] = field(default_factory=list)
    processor_s: float = 0.0
    peak_memory_mib: float = 0.0
    wall_s: float = 0.0

    def drops(self, recording: Recording, jpeg_quality: int | None) -> DropList:
        """The list with which a run offline gives the same result."""
        dropped, unmapped = {}, {}
        for robot, report in self.reports.items():
            name = robot.name.lower()
            if report is None:
                # Whatever it tracked, the mapper knows only this.
                everything = set(recording.of(robot).camera_stamps.tolist())
                dropped[name] = frozenset(everything - self.mapped_ns[robot].keys())
                continue
            dropped[name] = frozenset(report.played.dropped_ns)
            lost = (*report.shed_ns, *report.lost_ns, *self.late_ns[robot])
            unmapped[name] = frozenset(lost)
        return DropList(
            schema=SCHEMA,
            recording=fingerprint(recording),
            dropped=Stamps(**dropped),
            unmapped=Stamps(**unmapped),
            jpeg_quality=jpeg_quality,
        )


def add_live_rows(out: RowWriter, recording: Recording, lived: Lived, playback: Playback) -> None:
    """Write how a live run went.

    Latencies count from the moment when an image was due: `*_posed_ms` to its pose,
    `*_mapped_ms` to when the mapper was done with it, `aligned_ms` from the last image of an
    aerial surface to the surface's place in the ground map.
    """
    for robot, report in lived.reports.items():
        name = robot.name.lower()
        _add_latencies(out, f"{name}_mapped_ms", lived, lived.mapped_ns[robot])
        out.add(LIVE_STAGE, f"{name}_late", len(lived.late_ns[robot]), "")
        if report is None:
            out.add(LIVE_STAGE, f"{name}_survived", 0.0, "", note="its process died or fell silent")
        else:
            out.add(LIVE_STAGE, f"{name}_survived", 1.0, "")
            _add_report(out, name, report, lived)
    for latency_ms in lived.aligned_ms:
        out.add(LIVE_STAGE, "aligned_ms", latency_ms, "ms")
    out.add(LIVE_STAGE, "rate", playback.rate, "")
    out.add(LIVE_STAGE, "recorded_s", recording.duration_s, "s")
    out.add(LIVE_STAGE, "wall_s", lived.wall_s, "s")
    out.add(LIVE_STAGE, "mapper_processor_share", lived.processor_s / lived.wall_s, "")
    out.add(LIVE_STAGE, "mapper_peak_memory_mib", lived.peak_memory_mib, "MiB")


def _add_report(out: RowWriter, name: str, report: RobotReport, lived: Lived) -> None:
    played = report.played
    _add_latencies(out, f"{name}_posed_ms", lived, played.posed_ns)
    for metric, value, unit in (
        ("images", len(played.posed_ns) + len(played.dropped_ns), ""),
        ("dropped", len(played.dropped_ns), ""),
        ("shed", len(report.shed_ns), ""),
        ("lost", len(report.lost_ns), ""),
        ("longest_queue", played.longest_queue, ""),
        ("most_under_way", report.most_under_way, ""),
        ("sent_bytes", report.sent_bytes, "B"),
        ("processor_share", played.processor_s / lived.wall_s, ""),
        ("peak_memory_mib", report.peak_memory_mib, "MiB"),
    ):
        out.add(LIVE_STAGE, f"{name}_{metric}", value, unit)


def _add_latencies(out: RowWriter, metric: str, lived: Lived, done_ns: Mapping[int, int]) -> None:
    first_ns = lived.clock.first_ns
    for stamp_ns, at_ns in done_ns.items():
        time_s = (stamp_ns - first_ns) * 1e-9
        out.add(LIVE_STAGE, metric, lived.clock.passed_ms(stamp_ns, at_ns), "ms", time_s=time_s)

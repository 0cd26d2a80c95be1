"""What is measured of a live run: how late poses and maps come, and what was dropped."""

from __future__ import annotations

from collections.abc import Mapping

from airground.io.recording import Recording
from evaluation.realtime.live_summary import STAGE
from evaluation.realtime.lived import Lived, Playback
from evaluation.realtime.tracker_process import TrackerReport
from evaluation.results.row_writer import RowWriter


def add_live_rows(out: RowWriter, recording: Recording, lived: Lived, playback: Playback) -> None:
    """Write how a live run went.

    Latencies count from the moment when an image was due: `*_posed_ms` to its pose,
    `*_mapped_ms` to when the mapper was done with it, `aligned_ms` from the last image of an
    aerial surface to the surface's place in the ground map.
    """
    for robot, report in lived.reports.items():
        name = robot.name.lower()
        _add_latencies(out, f"{name}_mapped_ms", lived, lived.mapped_ns[robot])
        out.add(STAGE, f"{name}_late", len(lived.late_ns[robot]), "")
        if report is None:
            out.add(STAGE, f"{name}_survived", 0.0, "", note="its process died or fell silent")
        else:
            out.add(STAGE, f"{name}_survived", 1.0, "")
            _add_report(out, name, report, lived)
    for latency_ms in lived.aligned_ms:
        out.add(STAGE, "aligned_ms", latency_ms, "ms")
    out.add(STAGE, "rate", playback.rate, "")
    out.add(STAGE, "recorded_s", recording.duration_s, "s")
    out.add(STAGE, "wall_s", lived.wall_s, "s")
    out.add(STAGE, "mapper_processor_share", lived.processor_s / lived.wall_s, "")
    out.add(STAGE, "mapper_peak_memory_mib", lived.peak_memory_mib, "MiB")


def _add_report(out: RowWriter, name: str, report: TrackerReport, lived: Lived) -> None:
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
        out.add(STAGE, f"{name}_{metric}", value, unit)


def _add_latencies(out: RowWriter, metric: str, lived: Lived, done_ns: Mapping[int, int]) -> None:
    first_ns = lived.clock.first_ns
    for stamp_ns, at_ns in done_ns.items():
        time_s = (stamp_ns - first_ns) * 1e-9
        out.add(STAGE, metric, lived.clock.passed_ms(stamp_ns, at_ns), "ms", time_s=time_s)

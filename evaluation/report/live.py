"""The table of how live runs went, for the report and for the screen."""

from __future__ import annotations

from collections.abc import Callable

from evaluation.realtime.live_summary import (
    DEADLINE_MS,
    Latency,
    LiveRobot,
    LiveSummary,
    live_summary,
)
from evaluation.report.tables import MISSING, TextTable
from evaluation.results.table import ResultTable


def live_table(table: ResultTable) -> TextTable:
    """How the live runs in a table went; no rows where there was none."""
    summary = live_summary(table)
    rows = live_rows(summary) if summary is not None else ()
    return TextTable(("", "MAV", "ground robot"), rows)


def live_rows(summary: LiveSummary) -> tuple[tuple[str, str, str], ...]:
    """What is measured, of the MAV, of the ground robot; the mapper's once for both."""
    mav, ground = summary.mav, summary.ground

    def each(title: str, cell: Callable[[LiveRobot], str]) -> tuple[str, str, str]:
        return title, cell(mav), cell(ground)

    rows = [
        each("images dropped", lambda robot: f"{robot.dropped} of {robot.images}"),
        each("frames not mapped", _unmapped),
        each("pose after its image", lambda robot: _latency(robot.posed_ms)),
        each(f"poses later than {DEADLINE_MS:.0f} ms", lambda robot: str(robot.deadlines_missed)),
        each("mapped after its image", lambda robot: _latency(robot.mapped_ms)),
        ("surface located after its last image", _latency(summary.aligned_ms), ""),
        each("most images waiting", lambda robot: str(robot.longest_queue)),
        each("most frames before the mapper", lambda robot: str(robot.most_under_way)),
        each("sent to the mapper", lambda robot: _text(robot.mbit_s, "{:.2f} Mbit/s")),
        each("processor, of one core", lambda robot: _percent(robot.processor_share)),
        ("processor, mapper", "", _percent(summary.mapper_processor_share)),
        ("peak memory, all processes", "", _text(summary.peak_memory_mib, "{:.0f} MiB")),
    ]
    if min(mav.survived, ground.survived) < summary.runs:
        rows.insert(0, each("survived", lambda robot: f"{robot.survived} of {summary.runs}"))
    return tuple(rows)


def _unmapped(robot: LiveRobot) -> str:
    """Why frames did not reach the mapper, where some did not."""
    reasons = {"no room": robot.shed, "lost by the radio": robot.lost, "late": robot.late}
    told = [f"{count} {reason}" for reason, count in reasons.items() if count]
    return ", ".join(told) or "none"


def _latency(latency: Latency) -> str:
    if latency.median is None or latency.p95 is None or latency.worst is None:
        return MISSING
    return f"{latency.median:.0f}, {latency.p95:.0f}, {latency.worst:.0f} ms"


def _text(value: float | None, form: str) -> str:
    return MISSING if value is None else form.format(value)


def _percent(value: float | None) -> str:
    return _text(None if value is None else 100 * value, "{:.0f} %")

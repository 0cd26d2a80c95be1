"""The table of how live runs went, for the report and for the screen."""

from __future__ import annotations

from evaluation.realtime.live_summary import (
    DEADLINE_MS,
    Latency,
    LiveRobot,
    LiveSummary,
    live_summary,
)
from evaluation.report_tables import MISSING, TextTable
from evaluation.results import ResultTable


def live_table(table: ResultTable) -> TextTable:
    """How the live runs in a table went; no rows where there was none."""
    summary = live_summary(table)
    rows = live_rows(summary) if summary is not None else ()
    return TextTable(("", "MAV", "ground robot"), rows)


def live_rows(summary: LiveSummary) -> tuple[tuple[str, str, str], ...]:
    """What is measured, of the MAV, of the ground robot; the mapper's once for both."""
    mav, ground = summary.mav, summary.ground

    def both(title: str, mav_cell: str, ground_cell: str) -> tuple[str, str, str]:
        return title, mav_cell, ground_cell

    rows = [
        both("images dropped", *(f"{one.dropped} of {one.images}" for one in (mav, ground))),
        both("frames not mapped", _unmapped(mav), _unmapped(ground)),
        both("pose after its image", _latency(mav.posed_ms), _latency(ground.posed_ms)),
        both(
            f"poses later than {DEADLINE_MS:.0f} ms",
            str(mav.deadlines_missed),
            str(ground.deadlines_missed),
        ),
        both("mapped after its image", _latency(mav.mapped_ms), _latency(ground.mapped_ms)),
        ("surface located after its last image", _latency(summary.aligned_ms), ""),
        both("most images waiting", str(mav.longest_queue), str(ground.longest_queue)),
        both("most frames before the mapper", *(str(o.most_under_way) for o in (mav, ground))),
        both("sent to the mapper", *(_text(one.mbit_s, "{:.2f} Mbit/s") for one in (mav, ground))),
        both(
            "processor, of one core",
            *(_percent(one.processor_share) for one in (mav, ground)),
        ),
        ("processor, mapper", "", _percent(summary.mapper_processor_share)),
        ("peak memory, all processes", "", _text(summary.peak_memory_mib, "{:.0f} MiB")),
    ]
    if mav.survived < summary.runs or ground.survived < summary.runs:
        cells = (f"{one.survived} of {summary.runs}" for one in (mav, ground))
        rows.insert(0, both("survived", *cells))
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

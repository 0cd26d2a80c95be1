"""The short tables on the screen at the end of a run, and the table of live runs."""

from __future__ import annotations

from collections.abc import Callable

from rich.console import Console
from rich.table import Table

from evaluation.judge.claims import ALL
from evaluation.judge.live_summary import DEADLINE_MS, Latency, LiveRobot, LiveSummary, live_summary
from evaluation.judge.summary import Summary
from evaluation.show.report.tables import MISSING, TextTable
from evaluation.table.rows import ResultTable


def print_summary(summary: Summary, console: Console | None = None) -> None:
    """Print the headline numbers of a summary beside the paper's."""
    poses = {"oracle": "oracle poses", "slam": "poses from SLAM"}[summary.poses]
    shown = Table(
        title=f"{', '.join(summary.scenes)}: preset {summary.preset}, {poses}",
        caption="same protocol, simulated; the paper: real robots",
        title_justify="left",
        caption_justify="left",
    )
    shown.add_column("")
    shown.add_column("here", justify="right", style="bold")
    shown.add_column("paper", justify="right")
    for row in _rows(summary):
        shown.add_row(*row)
    console = console or Console()
    console.print(shown)
    if summary.realtime is not None:
        console.print(_live(summary.realtime))


def _live(summary: LiveSummary) -> Table:
    shown = Table(title="live", caption="latencies: median, 95 %, worst", title_justify="left")
    for header in ("", "MAV", "ground robot"):
        shown.add_column(header, justify="right" if header else "left")
    for row in live_rows(summary):
        shown.add_row(*row)
    return shown


def _rows(summary: Summary) -> list[tuple[str, str, str]]:
    localization, refinement = summary.localization, summary.refinement
    within = (
        ("within 0.5 m after 1 aerial map", localization.within_0_50_m, 1, "65 %"),
        ("within 0.25 m after 4", localization.within_0_25_m, 4, "89 %"),
    )
    rows = [("sequences", str(localization.sequences), "41")]
    for title, shares, iteration, paper in within:
        share = shares[iteration - 1] if len(shares) >= iteration else None
        rows.append((title, _percent(share), paper))
    after = refinement.after
    rows += [
        ("refinement trials", str(refinement.trials), "67"),
        ("refined, median position", _millimetres(after.translation_m.median), "76 mm"),
        ("refined, median angle", _text(after.rotation_deg.median, "{:.2f}°"), "3.0°"),
        ("refined within 5 cm and 2°", _percent(refinement.within_5cm_2deg), "-"),
        *_claims(summary),
        ("fused surface, median error", _millimetres(summary.surface.error_median_m), "-"),
        ("fused surface, completeness", _percent(summary.surface.completeness), "-"),
        ("recorded s / processing s", _text(summary.real_time_factor, "{:.2f}"), "real time"),
    ]
    return rows


def _claims(summary: Summary) -> list[tuple[str, str, str]]:
    """Over all cases, those without a place to find included."""
    every = summary.claims.localization.get(ALL) if summary.claims is not None else None
    if every is None:
        return []
    return [
        ("localizations that claim a place", _percent(every.accepted.share), "-"),
        ("wrong among them, all cases", _percent(every.wrong.share), "-"),
    ]


def _text(value: float | None, form: str) -> str:
    return "-" if value is None else form.format(value)


def _percent(value: float | None) -> str:
    return "-" if value is None else f"{100 * value:.1f} %"


def _millimetres(value: float | None) -> str:
    return "-" if value is None else f"{1e3 * value:.1f} mm"


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
        each("sent to the mapper", lambda robot: _live_text(robot.mbit_s, "{:.2f} Mbit/s")),
        each("processor, of one core", lambda robot: _live_percent(robot.processor_share)),
        ("processor, mapper", "", _live_percent(summary.mapper_processor_share)),
        ("peak memory, all processes", "", _live_text(summary.peak_memory_mib, "{:.0f} MiB")),
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


def _live_text(value: float | None, form: str) -> str:
    return MISSING if value is None else form.format(value)


def _live_percent(value: float | None) -> str:
    return _live_text(None if value is None else 100 * value, "{:.0f} %")

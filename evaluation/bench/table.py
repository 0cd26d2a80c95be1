"""The benchmark as a table on the screen, or in Markdown for the docs."""

from __future__ import annotations

from rich.console import Console
from rich.table import Table
from rich.text import Text

from evaluation.bench.report import BenchReport, CurveResult, LaneTiming, RowResult
from evaluation.show.report.screen import live_rows

ABSENT = "-"
BUSY_CORES = 0.2
"""Where other programs keep more cores busy than this, the table says that it shows."""


def header(report: BenchReport) -> list[str]:
    """Titles of the columns."""
    lanes = [_cores(speed.threads) for speed in report.machine.speeds]
    return ["stage [ms]", *lanes, "CPU", "paper", "target", "floor", "peer", "memory"]


def body(report: BenchReport) -> list[list[str]]:
    """One list of words for each row, and for each further peer of it."""
    lines = []
    for row in report.rows:
        first, *others = _peers(row) or [ABSENT]
        lines.append([row.title, *map(_lane, row.lanes), *_marks(row), first, _memory(row)])
        width = len(lines[-1])
        lines += [[*[""] * (width - 2), other, ""] for other in others]
    return lines


def footnotes(report: BenchReport) -> list[str]:
    """What the table's figures rest on, one line each."""
    machine = report.machine
    lines = [
        f"{_cores(real.threads)}: {real.recorded_s:.0f} s recorded, {real.processing_s:.1f} s for "
        f"the whole pipeline with SLAM: real-time factor {real.real_time_factor:.2f} "
        f"({real.cpu_s:.1f} s of processor time{_peak(real.peak_memory_mib)})"
        for real in report.pipeline
    ]
    lines += [
        f"{_cores(real.threads)}: {min(real.resident_mib):.0f} to {max(real.resident_mib):.0f} MiB "
        f"held after the tenths of the recording, at the end {real.resident_mib[-1]:.0f}"
        for real in report.pipeline
        if real.resident_mib
    ]
    if report.live is not None:
        lines += [f"live, {_of_robots(*row)}" for row in live_rows(report.live)]
    lines += [
        f"{_cores(speed.threads)}: {speed.bandwidth_gb_s:.1f} GB/s, "
        f"{speed.arithmetic_gflop_s:.0f} Gflop/s as probed; floors come from these"
        for speed in machine.speeds
    ]
    others = machine.other_cores
    busy = "unknown" if others is None else f"{others:.2f} cores busy"
    if others is not None and others > BUSY_CORES:
        lines.insert(0, "measured under load: times by the clock are too long, floors apart")
    lines.append(
        f"load average {machine.load_before.one_minute:.2f} before, "
        f"{machine.load_after.one_minute:.2f} after; other programs: {busy}"
    )
    recording = report.recording
    lines.append(
        f"{machine.cpu}; {recording.scene} (seed {recording.seed}, sensors {recording.sensors}); "
        f"{report.git_revision}; {report.date}"
    )
    lines += [
        f"{row.title}: {', '.join(row.missing_peers)} not installed"
        for row in report.rows
        if row.missing_peers
    ]
    return lines


def _of_robots(title: str, mav: str, ground: str) -> str:
    """A row of the table of live runs in one line."""
    both = f"MAV {mav}, ground robot {ground}" if mav and ground else mav or ground
    return f"{title}: {both}"


def print_table(report: BenchReport, console: Console) -> None:
    """Print what was measured, and under which conditions."""
    # Square brackets are units here, no markup.
    shown = Table(title=Text("median, 95 % (calls) [ms]; the paper: Table I"), title_justify="left")
    for index, title in enumerate(header(report)):
        left = index == 0 or title == "peer"
        shown.add_column(Text(title), justify="left" if left else "right", overflow="fold")
    for words in body(report):
        shown.add_row(*map(Text, words))
    console.print(shown)
    for line in (*footnotes(report), *map(_growth, report.curves)):
        console.print(line, highlight=False, markup=False)


def markdown(report: BenchReport) -> str:
    """The table, the conditions and the exponents, for a page of the docs."""
    table = [header(report), ["---"] * len(header(report)), *body(report)]
    text = ["| " + " | ".join(line) + " |" for line in table]
    text += ["", *(f"- {line}" for line in footnotes(report))]
    if report.curves:
        text += ["", "| time of | over | power | of CPU time | medians [ms] |"]
        text += ["|---|---|---|---|---|"]
    for curve in report.curves:
        powers = f"{curve.exponent:.2f} | {curve.cpu_exponent:.2f}"
        text.append(f"| {curve.title} | {curve.parameter} | {powers} | {_points(curve)} |")
    return "\n".join(text) + "\n"


def _growth(curve: CurveResult) -> str:
    return (
        f"{curve.title} over {curve.parameter}: power {curve.exponent:.2f}, of processor time "
        f"{curve.cpu_exponent:.2f} ({_points(curve)} ms)"
    )


def _points(curve: CurveResult) -> str:
    return ", ".join(f"{p.value:g}: {_ms(p.timing.median_ms)}" for p in curve.points)


def _lane(lane: LaneTiming) -> str:
    """Median, 95th percentile and count; the mean where few calls are much longer than most."""
    timing = lane.timing
    words = f"{_ms(timing.median_ms)}, {_ms(timing.p95_ms)} ({timing.n})"
    skewed = timing.mean_ms > 1.2 * timing.median_ms
    return f"{words}, mean {_ms(timing.mean_ms)}" if skewed else words


def _marks(row: RowResult) -> list[str]:
    gpu = " GPU" if row.published_on == "GPU" else ""
    published = ABSENT if row.published_ms is None else f"{row.published_ms:g}{gpu}"
    best = row.best
    return [_ms(best.timing.cpu_median_ms), published, _ms(row.target_ms), _ms(best.floor_ms)]


def _peers(row: RowResult) -> list[str]:
    return [
        f"{peer.name} {_ms(peer.timing.median_ms)} ({peer.times_ours:.1f}x)" for peer in row.peers
    ]


def _memory(row: RowResult) -> str:
    return ABSENT if row.peak_memory_mib is None else f"{row.peak_memory_mib:.0f} MiB"


def _peak(memory_mib: float | None) -> str:
    return "" if memory_mib is None else f", {memory_mib:.0f} MiB at the peak"


def _cores(threads: int) -> str:
    return "1 core" if threads == 1 else f"{threads} cores"


def _ms(value: float | None) -> str:
    """Three figures, or as many as there are before the point."""
    if value is None:
        return ABSENT
    return f"{value:.0f}" if value >= 100 else f"{value:.3g}"

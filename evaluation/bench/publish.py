"""The benchmark as a table: on the screen, in Markdown, and with its pictures in the docs.
`python -m evaluation.bench.publish DIR` puts the results in DIR into this checkout's docs."""

from __future__ import annotations

import sys
from pathlib import Path

from rich.console import Console

from airground.errors import InputError
from evaluation.bench.picture import bench_figure, cores, curves_figure, milliseconds
from evaluation.bench.report import KIND, BenchReport, CurveResult, LaneTiming, RowResult
from evaluation.setup import console, text
from evaluation.setup.checked_json import read_checked
from evaluation.show.figures.style import PICTURE_DPI
from evaluation.show.report.screen import live_rows

ABSENT = "-"
BUSY_CORES = 0.2
"""Above this mean number of cores busy with other programs, a line warns of load."""
BEGIN = "<!-- what airground bench found: begin -->"
END = "<!-- what airground bench found: end -->"


def print_table(report: BenchReport, screen: Console) -> None:
    """Print the results and the conditions of the measurement."""
    titles = header(report)
    table = text.TextTable(tuple(titles), tuple(map(tuple, body(report))))
    title = "median, 95 % (calls) [ms]; the paper: Table I"
    text.print_table(table, title, console=screen, left=(0, titles.index("peer")))
    growth = (
        f"{title} over {parameter}: power {power}, of processor time {cpu_power} ({points} ms)"
        for title, parameter, power, cpu_power, points in map(_curve, report.curves)
    )
    for line in (*footnotes(report), *growth):
        screen.print(line, highlight=False, markup=False)


def markdown(report: BenchReport) -> str:
    """The table, the conditions and the exponents, for a page of the docs."""
    lines = text.markdown_table(header(report), body(report))
    lines += ["", *(f"- {text.markdown_text(line)}" for line in footnotes(report))]
    if report.curves:
        titles = ["time of", "over", "power", "of CPU time", "medians [ms]"]
        lines += ["", *text.markdown_table(titles, [_curve(curve) for curve in report.curves])]
    return "\n".join(lines) + "\n"


def publish(results: Path, docs: Path) -> None:
    """Refresh `speed.md` and its pictures by a folder that `airground bench --out` has written."""
    report = read_checked(BenchReport, results / "bench.json", KIND)
    page = docs / "speed.md"
    page.write_text(with_table(page.read_text(encoding="utf-8"), report), encoding="utf-8")
    if report.rows:
        bench_figure(report).savefig(docs / "pictures" / "bench.png", dpi=PICTURE_DPI)
    if report.curves:
        curves_figure(report).savefig(docs / "pictures" / "bench_curves.png", dpi=PICTURE_DPI)


def with_table(page: str, report: BenchReport) -> str:
    """The page with the report's table between its two marks.

    Raises:
        InputError: The page has no such marks.
    """
    before, begin, rest = page.partition(BEGIN)
    _, end, after = rest.partition(END)
    if not begin or not end:
        raise InputError(f"the page has no lines {BEGIN} and {END}")
    return f"{before}{BEGIN}\n\n{markdown(report)}\n{END}{after}"


def header(report: BenchReport) -> list[str]:
    lanes = [cores(speed.threads) for speed in report.machine.speeds]
    return ["stage [ms]", *lanes, "CPU", "paper", "target", "floor", "peer", "memory"]


def body(report: BenchReport) -> list[list[str]]:
    """One list of words for each row, and for each further peer of it."""
    lines = []
    for row in report.rows:
        first, *others = _peers(row) or [ABSENT]
        memory = text.formatted(row.peak_memory_mib, "{:.0f} MiB")
        lines.append([row.title, *map(_lane, row.lanes), *_marks(row), first, memory])
        width = len(lines[-1])
        lines += [[*[""] * (width - 2), other, ""] for other in others]
    return lines


def footnotes(report: BenchReport) -> list[str]:
    """The conditions of the measurement, one line each."""
    machine = report.machine
    lines = [
        f"{cores(real.threads)}: {real.recorded_s:.0f} s recorded, {real.processing_s:.1f} s for "
        f"the whole pipeline with SLAM: real-time factor {real.real_time_factor:.2f} "
        f"({real.cpu_s:.1f} s of processor time{_peak(real.peak_memory_mib)})"
        for real in report.pipeline
    ]
    lines += [
        f"{cores(real.threads)}: {min(real.resident_mib):.0f} to {max(real.resident_mib):.0f} MiB "
        f"held after the tenths of the recording, at the end {real.resident_mib[-1]:.0f}"
        for real in report.pipeline
        if real.resident_mib
    ]
    lines += [
        f"{cores(made.threads)}: {made.recorded_s:.0f} s of {made.scene} with {made.sensors} "
        f"sensors simulated in {made.wall_s:.1f} s: {made.recorded_s_a_second:.2f} recorded "
        f"seconds per second, {made.cpu_ms_an_image:.1f} ms of processor time per image, "
        f"{made.mib_a_minute:.0f} MiB per minute"
        for made in report.recordings
    ]
    if report.live is not None:
        for title, mav, ground in live_rows(report.live):
            both = f"MAV {mav}, ground robot {ground}" if mav and ground else mav or ground
            lines.append(f"live, {title}: {both}")
    lines += [
        f"{cores(speed.threads)}: {speed.bandwidth_gb_s:.1f} GB/s, "
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


def _curve(curve: CurveResult) -> list[str]:
    """Stage, parameter, both powers, and the times by value."""
    points = (f"{point.value:g}: {_ms(point.timing.median_ms)}" for point in curve.points)
    powers = f"{curve.exponent:.2f}", f"{curve.cpu_exponent:.2f}"
    return [curve.title, curve.parameter, *powers, ", ".join(points)]


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


def _peak(memory_mib: float | None) -> str:
    return "" if memory_mib is None else f", {memory_mib:.0f} MiB at the peak"


def _ms(value: float | None) -> str:
    return ABSENT if value is None else milliseconds(value)


def main() -> int:
    """Publish the folder named on the command line into this checkout's docs."""
    if len(sys.argv) != 2:
        raise InputError("usage: python -m evaluation.bench.publish DIR")
    publish(Path(sys.argv[1]), Path(__file__).parent.parent.parent / "docs")
    return console.EXIT_OK


if __name__ == "__main__":
    sys.exit(console.run(main))

"""The benchmark as two pictures: bars against paper, peer and floor; and how times grow."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, FuncFormatter, LogLocator, NullLocator

from evaluation.bench.report import BenchReport, CurveResult, RowResult
from evaluation.show.figures.style import FAINT, INK, PAPER, SERIES, SMALL_PT, WIDE_IN, styled

HERE, PEER = SERIES[0], SERIES[1]
BAR = 0.56
COLUMNS = 4
"""Number of curves beside each other."""


@styled
def bench_figure(report: BenchReport) -> Figure:
    """One bar per row: the median with all cores, a whisker to 95 %, one core as a tick.
    The number at the right end is the median [ms]. The part of a bar below the machine's floor is
    dark. The paper's value is a diamond, hollow where the paper used a GPU; peers are triangles."""
    rows = report.rows
    figure = Figure(figsize=(WIDE_IN, 0.30 * len(rows) + 1.45), layout="constrained")
    axes = figure.subplots()
    low, high = _limits(rows)
    for place, row in enumerate(rows):
        _draw_row(axes, place, row, low)
    _headings(axes, rows)
    axes.set_xscale("log")
    axes.set_xlim(low, high)
    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.xaxis.set_minor_locator(NullLocator())
    axes.set_yticks(range(len(rows)), [row.title for row in rows])
    axes.tick_params(axis="y", length=0)
    axes.set_ylim(len(rows) - 0.4, -0.6)
    axes.set_xlabel("time of one call [ms]")
    axes.annotate(
        "median", (1, -0.6), (27, 5), xycoords=axes.get_yaxis_transform(),
        textcoords="offset points", ha="right", fontsize=7.5, color=HERE,
    )  # fmt: skip
    axes.grid(axis="x")
    axes.set_title(_conditions(report), fontsize=SMALL_PT, fontweight="normal", color=FAINT)
    _legend(figure, axes, report)
    return figure


def _limits(rows: Sequence[RowResult]) -> tuple[float, float]:
    values = [lane.timing.median_ms for row in rows for lane in row.lanes]
    values += [row.best.timing.p95_ms for row in rows]
    values += [row.published_ms for row in rows if row.published_ms is not None]
    values += [peer.timing.median_ms for row in rows for peer in row.peers]
    values += [row.best.floor_ms for row in rows if row.best.floor_ms]
    smallest = min(value for value in values if value > 0)
    return max(10 ** math.floor(math.log10(smallest)), 0.01), max(values) * 2


def _draw_row(axes: Axes, place: int, row: RowResult, low: float) -> None:
    timing = row.best.timing
    axes.barh(place, timing.median_ms - low, left=low, height=BAR, color=HERE, alpha=0.45)
    if row.best.floor_ms is not None:
        dark = min(row.best.floor_ms, timing.median_ms)
        if dark > low:
            axes.barh(place, dark - low, left=low, height=BAR, color=HERE)
    axes.hlines(place, timing.median_ms, timing.p95_ms, color=HERE, linewidth=1.4)
    axes.vlines(timing.p95_ms, place - 0.13, place + 0.13, color=HERE, linewidth=1.4)
    if len(row.lanes) > 1:
        one = row.lanes[0].timing.median_ms
        axes.vlines(one, place - BAR / 2, place + BAR / 2, color=INK, linewidth=1.6)
    for peer in row.peers:
        axes.plot(peer.timing.median_ms, place, ">", color=PEER, markersize=7.5, zorder=4)
    if row.published_ms is not None:
        axes.plot(
            row.published_ms, place, "D", color=PAPER, markersize=7, zorder=5,
            markerfacecolor="white" if row.published_on == "GPU" else PAPER, markeredgewidth=1.6,
        )  # fmt: skip
    axes.annotate(
        milliseconds(timing.median_ms), (1, place), (27, 0), xycoords=axes.get_yaxis_transform(),
        textcoords="offset points", ha="right", va="center", color=HERE, fontweight="bold",
    )  # fmt: skip


def _headings(axes: Axes, rows: Sequence[RowResult]) -> None:
    """A line above each group but the first, and the group's name at its right end."""
    for place, row in enumerate(rows):
        if place == 0 or rows[place - 1].group != row.group:
            if place:
                axes.axhline(place - 0.5, color="#D9DCE0", linewidth=0.8)
            axes.annotate(
                row.group, (1, place - 0.46), (-4, 0), xycoords=axes.get_yaxis_transform(),
                textcoords="offset points", ha="right", va="top", fontsize=SMALL_PT, color=FAINT,
            )  # fmt: skip


def _legend(figure: Figure, axes: Axes, report: BenchReport) -> None:
    here = cores(report.machine.speeds[-1].threads)
    axes.barh(0, 0, color=HERE, alpha=0.45, label=f"here, {here}: median, whisker to 95 %")
    axes.barh(0, 0, color=HERE, label="of it, the machine's floor")
    if any(len(row.lanes) > 1 for row in report.rows):
        axes.plot([], [], "|", color=INK, markersize=11, markeredgewidth=1.6, label="here, 1 core")
    axes.plot([], [], "D", color=PAPER, markersize=7, label="paper, CPU")
    axes.plot([], [], "D", color=PAPER, markerfacecolor="white", markersize=7, label="paper, GPU")
    axes.plot([], [], ">", color=PEER, markersize=7.5, label="another library")
    figure.legend(loc="outside upper left", ncols=3)


def _conditions(report: BenchReport) -> str:
    """Two lines: a processor's long name would run into the heading beside the second."""
    machine = report.machine
    others = machine.other_cores
    busy = "unknown" if others is None else f"{others:.1f} cores"
    return (
        f"{machine.cpu}, {machine.cores} cores\nbusy with other programs meanwhile: {busy}; "
        f"{report.recording.scene}, {report.git_revision}"
    )


@styled
def curves_figure(report: BenchReport) -> Figure:
    """Growth of each stage's time with one size, and the exponents of the fitted power laws.
    Medians by the clock in front, of the processor time of all threads behind."""
    curves = report.curves
    height = math.ceil(len(curves) / COLUMNS)
    figure = Figure(figsize=(WIDE_IN, WIDE_IN / COLUMNS * height), layout="constrained")
    grid = figure.subplots(height, COLUMNS, squeeze=False)
    for axes, curve in zip(grid.flat, curves, strict=False):
        _draw_curve(axes, curve)
    for axes in grid.flat[len(curves) :]:
        axes.set_visible(False)
    figure.supylabel("median [ms]: by the clock (blue), processor time (grey)", fontsize=8)
    return figure


def _draw_curve(axes: Axes, curve: CurveResult) -> None:
    values = [point.value for point in curve.points]
    times = [point.timing.median_ms for point in curve.points]
    processor = [point.timing.cpu_median_ms or math.nan for point in curve.points]
    axes.plot(values, processor, "o--", color=FAINT, markersize=4, linewidth=1.2)
    axes.plot(values, times, "o-", color=HERE, markersize=5, linewidth=1.6)
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.xaxis.set_major_locator(FixedLocator(values))
    axes.xaxis.set_minor_locator(NullLocator())
    low, high = np.nanmin([*times, *processor]), np.nanmax([*times, *processor])
    # At least one decade is shown, so that a flat curve looks flat; the top is for the words.
    room = max(0.0, 1.0 - math.log10(high / low)) / 2
    low, high = low / 10 ** (room + 0.1), high * 10 ** (room + 0.1)
    axes.set_ylim(low, high * (high / low) ** 0.3)
    axes.yaxis.set_major_locator(LogLocator(base=10, subs=(1, 3)))
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.yaxis.set_minor_locator(NullLocator())
    axes.set_title(curve.title)
    axes.set_xlabel(curve.parameter)
    axes.grid()
    for height, words, colour in (
        (0.96, f"power {curve.exponent:.2f}", HERE),
        (0.86, f"CPU {curve.cpu_exponent:.2f}", FAINT),
    ):
        axes.text(
            0.04, height, words, transform=axes.transAxes, color=colour, fontweight="bold",
            va="top",
        )  # fmt: skip


def cores(threads: int) -> str:
    return "1 core" if threads == 1 else f"{threads} cores"


def milliseconds(value: float) -> str:
    """Three figures, or as many as there are before the point."""
    return f"{value:.0f}" if value >= 100 else f"{value:.3g}"

"""Table I as a picture, and ratios of times between runs."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator
from numpy.typing import NDArray

from evaluation.setup.published import TABLE_I
from evaluation.show.figures.style import (
    FAINT,
    INK,
    LABEL_PT,
    PAPER,
    SERIES,
    WIDE_IN,
    plain_numbers,
    styled,
)

BAR: dict[str, Any] = {"color": SERIES[0], "alpha": 0.75}


@styled
def timing_figure(durations_ms: dict[str, NDArray[np.float64]]) -> Figure:
    """Median as a bar, 95th percentile as a whisker, the paper's average as a diamond.

    Args:
        durations_ms: Name of a stage -> (N,) durations [ms], N >= 1. A stage that was not
            measured is drawn only if the paper has a value.
    """
    stages = [s for s in TABLE_I if s.metric in durations_ms or s.published_ms is not None]
    figure = Figure(figsize=(WIDE_IN, 0.28 * len(stages) + 1.0), layout="constrained")
    axes = figure.subplots()
    for row, stage in enumerate(stages):
        measured = durations_ms.get(stage.metric)
        if measured is not None and len(measured):
            median, p95 = np.percentile(measured, [50, 95])
            axes.barh(row, median, left=0, height=0.55, **BAR)
            axes.hlines(row, median, p95, color=SERIES[0], linewidth=1.6)
            axes.vlines(p95, row - 0.16, row + 0.16, color=SERIES[0], linewidth=1.6)
        else:
            axes.text(0.12, row, "not run", color=FAINT, va="center", fontsize=LABEL_PT)
        if stage.published_ms is not None:
            face = "white" if stage.processor == "GPU" else PAPER
            axes.plot(
                stage.published_ms, row, "D", color=PAPER, markersize=7, zorder=5,
                markerfacecolor=face, markeredgewidth=1.6,
            )  # fmt: skip
    axes.set_xscale("log")
    axes.set_xlim(0.1, 2e4)
    _label_rows(axes, [stage.title for stage in stages], "time [ms]")
    axes.barh([], [], **BAR, label="measured: median, whisker to 95 %")
    axes.plot([], [], "D", color=PAPER, label="paper, CPU")
    axes.plot([], [], "D", color=PAPER, markerfacecolor="white", label="paper, GPU")
    figure.legend(loc="outside upper left", ncols=3)
    return figure


@styled
def time_ratio_figure(
    ratios: dict[str, list[float | None]], labels: Sequence[str], colours: Sequence[str]
) -> Figure:
    """One row per stage, one dot per run; the line is the reference; None was not measured."""
    figure = Figure(figsize=(WIDE_IN, 0.27 * len(ratios) + 0.95), layout="constrained")
    axes = figure.subplots()
    axes.axvline(1.0, color=INK, linewidth=1.0)
    for column, (label, colour) in enumerate(zip(labels, colours, strict=True)):
        shift = 0.18 * (column - (len(labels) - 1) / 2)
        for row, values in enumerate(ratios.values()):
            ratio = values[column]
            if ratio is not None:
                axes.hlines(row + shift, min(1.0, ratio), max(1.0, ratio), color=colour, alpha=0.4)
                axes.plot(ratio, row + shift, "o", color=colour, markersize=5.5)
        axes.plot([], [], "o", color=colour, label=label)
    reach = max(1.5, 1.15 * max(max(r, 1 / r) for values in ratios.values() for r in values if r))
    axes.set_xscale("log")
    axes.set_xlim(1 / reach, reach)
    axes.xaxis.set_major_locator(LogLocator(base=10, subs=(0.25, 0.5, 0.7, 1.0, 1.4, 2.0, 4.0)))
    _label_rows(axes, list(ratios), "median time divided by that of the reference")
    figure.legend(loc="outside upper left", ncols=3)
    return figure


def _label_rows(axes: Axes, titles: list[str], label: str) -> None:
    """Rows from top to bottom over a logarithmic axis."""
    plain_numbers(axes.xaxis)
    axes.set_yticks(range(len(titles)), titles)
    axes.set_ylim(len(titles) - 0.4, -0.6)
    axes.set_xlabel(label)
    axes.grid(axis="x")

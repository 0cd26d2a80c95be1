"""One figure per metric: its values over revisions, with intervals and levels between steps."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from evaluation.judge.history.points import Point
from evaluation.judge.history.series import History, Series, Step
from evaluation.judge.verdict import Verdict
from evaluation.show.figures.style import (
    COLUMN_IN,
    DASHED,
    FAINT,
    INK,
    LABEL_PT,
    PAPER,
    SERIES,
    SMALL_PT,
    ReportFigure,
    styled,
)
from evaluation.table.comparison import median

HEIGHT_IN = 2.3
LABELS_PT = 24.0
"""Space between a panel and its title for the verdicts of steps [pt]."""
MOST_LABELS = 12
"""Revisions that are named below an axis; more would overlap."""
REVISION_CHARACTERS = 7
UNITS = {
    "m": ("mm", 1e3),
    "deg": ("deg", 1.0),
    "count": ("", 1.0),
    "cost": ("", 1.0),
    "": ("%", 100.0),
}
"""How a metric's unit is drawn."""
WORSE = (Verdict.WORSE, Verdict.SLIGHTLY_WORSE)


def history_figure(series: Series, found: History) -> ReportFigure:
    """The figure of one metric that has a value at some point."""
    metric = series.metric
    unit, scale = UNITS[metric.unit]
    title = f"{metric.title} [{unit}]" if unit else metric.title
    return ReportFigure(
        metric.name,
        metric.title,
        f"{metric.better.capitalize()} is better. {_caption(series, found.points)}",
        draw(series, found.points, title, scale),
        wide=False,
    )


def short(revision: str) -> str:
    """The beginning of a revision, as axes show it."""
    return revision[:REVISION_CHARACTERS]


def _caption(series: Series, points: Sequence[Point]) -> str:
    """What is seen, in words."""
    if not series.steps:
        return "No step."
    words = []
    for step in series.steps:
        text = series.metric.fine_text
        words.append(
            f"{str(step.verdict).capitalize()} at {points[step.place].revision}: "
            f"{text(step.before)} to {text(step.after)}."
        )
    return " ".join(words)


@styled
def draw(series: Series, points: Sequence[Point], title: str, scale: float) -> Figure:
    """Figures with their intervals over flights, and the level of each segment."""
    figure = Figure(figsize=(COLUMN_IN, HEIGHT_IN), layout="constrained")
    axes = figure.add_subplot()
    values = scale * series.values
    place = np.arange(len(values))
    finite = np.isfinite(values)
    has = np.isfinite(series.low) & np.isfinite(series.high) & finite
    axes.vlines(
        place[has], scale * series.low[has], scale * series.high[has], color=FAINT, linewidth=1.2
    )
    whole = np.array([bool(point.samples) for point in points])
    for chosen, face in ((finite & whole, SERIES[0]), (finite & ~whole, "white")):
        axes.plot(place[chosen], values[chosen], "o", ms=4, mfc=face, mec=SERIES[0], zorder=3)
    _levels(axes, values, series.steps)
    failed = np.isinf(values)
    axes.plot(
        place[failed], np.full(failed.sum(), 0.97), "x", color=PAPER, ms=5,
        transform=axes.get_xaxis_transform(), clip_on=False,
    )  # fmt: skip
    axes.set_title(title, pad=LABELS_PT if series.steps else None)
    axes.grid(axis="y")
    axes.set_xlim(-0.5, len(values) - 0.5)
    axes.margins(y=0.12)
    if finite.any() and np.ptp(values[finite]) == 0 and not has.any():
        middle = float(values[finite][0])
        axes.set_ylim(middle - 1, middle + 1)
    every = int(np.ceil(len(values) / MOST_LABELS))
    named = place[::-every][::-1]
    axes.set_xticks(
        named, [short(points[n].revision) for n in named], rotation=45, ha="right",
        rotation_mode="anchor", fontsize=SMALL_PT,
    )  # fmt: skip
    return figure


def _levels(axes: Axes, values: NDArray[np.float64], steps: Sequence[Step]) -> None:
    """The median of each segment between steps, and a mark at each step."""
    ends = [0, *(step.place for step in steps), len(values)]
    for start, end in pairwise(ends):
        segment = values[start:end]
        if np.isfinite(segment).any():
            level = median(segment[np.isfinite(segment)])
            axes.plot([start - 0.5, end - 0.5], [level, level], color=INK, linewidth=0.9, zorder=2)
    for step in steps:
        colour = PAPER if step.verdict in WORSE else SERIES[2]
        axes.axvline(step.place - 0.5, color=colour, linewidth=1.1, linestyle=DASHED)
        axes.text(
            step.place - 0.5, 1.01, str(step.verdict), color=colour, fontsize=LABEL_PT,
            transform=axes.get_xaxis_transform(), ha="left", va="bottom", rotation=40,
            rotation_mode="anchor",
        )  # fmt: skip

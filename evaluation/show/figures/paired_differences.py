"""Paired differences by metric: a dot per flight, and the effect as a bar with its interval."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from evaluation.show.figures.style import INK, LABEL_PT, PAPER, WIDE_IN, styled

COLUMNS = 3


@dataclass(frozen=True)
class Differences:
    """Change of one metric in one run; +inf for a new failure, -inf for a failure less.

    Attributes:
        each: (N,) after minus before.
        effect: The effect that is reported.
        low, high: Its 95 % interval.
    """

    each: NDArray[np.float64]
    effect: float
    low: float
    high: float


@dataclass(frozen=True)
class Panel:
    """One metric: differences of each run, in the unit that the title names."""

    title: str
    lower_is_better: bool
    runs: list[Differences]


@styled
def paired_differences_figure(
    panels: Sequence[Panel], labels: Sequence[str], colours: Sequence[str]
) -> Figure:
    """One panel per metric, one column of dots per run; the side that is worse is shaded."""
    rows = -(-len(panels) // COLUMNS)
    figure = Figure(figsize=(WIDE_IN, 1.7 * rows + 0.25), layout="constrained")
    grid = figure.subplots(rows, COLUMNS, squeeze=False).ravel()
    for axes, panel in zip(grid, panels, strict=False):
        _draw(axes, panel, colours)
    for axes in grid[len(panels) :]:
        axes.set_axis_off()
    for label, colour in zip(labels, colours, strict=True):
        grid[0].plot([], [], "o", color=colour, markersize=4.5, label=label)
    figure.legend(loc="outside upper left", ncols=len(labels))
    return figure


def _draw(axes: Axes, panel: Panel, colours: Sequence[str]) -> None:
    bottom, top = _limits(panel.runs)
    axes.set_ylim(bottom, top)
    worse = (0, top) if panel.lower_is_better else (bottom, 0)
    axes.axhspan(*worse, color=PAPER, alpha=0.06, linewidth=0)
    axes.axhline(0, color=INK, linewidth=0.9)
    for column, (one, colour) in enumerate(zip(panel.runs, colours, strict=True)):
        finite = np.sort(one.each[np.isfinite(one.each)])
        # Side by side in the order of their size, so that none hides another.
        x = (
            column + np.linspace(-0.3, 0.08, len(finite))
            if len(finite) > 1
            else [column] * len(finite)
        )
        axes.plot(x, finite, "o", color=colour, alpha=0.6, markersize=3.5, markeredgewidth=0)
        bar = column + 0.25
        axes.vlines(bar, *np.clip([one.low, one.high], bottom, top), color=colour, linewidth=1.6)
        if np.isfinite(one.effect):
            axes.hlines(one.effect, bar - 0.1, bar + 0.1, color=colour, linewidth=2.8)
        for failures, y, align in ((np.inf, 1.0, "top"), (-np.inf, 0.0, "bottom")):
            if count := int(np.sum(one.each == failures)):
                axes.text(
                    column, y, f"{count}✕", transform=axes.get_xaxis_transform(), ha="center",
                    va=align, color=colour, fontsize=LABEL_PT,
                )  # fmt: skip
    axes.set_xlim(-0.6, len(panel.runs) - 0.4)
    axes.set_xticks([])
    axes.set_title(panel.title, fontsize=8)


def _limits(runs: Sequence[Differences]) -> tuple[float, float]:
    """Limits around all finite values, with room on both sides of 0."""
    values = np.concatenate([[*one.each, one.effect, one.low, one.high] for one in runs])
    finite = values[np.isfinite(values)]
    low, high = finite.min(initial=0.0), finite.max(initial=0.0)
    room = 0.15 * (high - low) or 1.0
    return float(low - room), float(high + room)

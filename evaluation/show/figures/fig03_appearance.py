"""Beside Fig. 3: how often matched images locate the MAV, against view angle, light and print."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import PercentFormatter
from numpy.typing import NDArray

from evaluation.show.figures.style import SERIES, WIDE_IN, styled
from evaluation.table.intervals import wilson

MARKERS = ("o", "s", "^", "D")
_OFFSET = 0.008
"""Shift of the intervals of each scene along x, so that none hides another; of the axis' width."""


@dataclass(frozen=True, eq=False)
class Curve:
    """Pairs of images of one scene, under one condition that varies.

    Attributes:
        values: (N,) value of the condition, for each pair.
        right: (N,) number of right matches.
        located: (N,) whether the MAV is located.
    """

    values: NDArray[np.float64]
    right: NDArray[np.float64]
    located: NDArray[np.bool_]


@styled
def appearance_figure(curves: Mapping[str, Mapping[str, Curve]]) -> Figure:
    """Share of located pairs above, right matches below: a column for each condition's label and a
    line for each scene."""
    figure = Figure(figsize=(WIDE_IN, 3.9), layout="constrained")
    grid = figure.subplots(2, len(curves), sharex="col", sharey="row", squeeze=False)
    names = list(dict.fromkeys(name for of_scenes in curves.values() for name in of_scenes))
    for column, (label, of_scenes) in zip(grid.T, curves.items(), strict=True):
        span = max(np.ptp(curve.values) for curve in of_scenes.values()) or 1.0
        for name, curve in of_scenes.items():
            index = names.index(name)
            shift = _OFFSET * span * (index - (len(names) - 1) / 2)
            style = {"color": SERIES[index % 4], "marker": MARKERS[index // 4 % 4]}
            _draw(column, curve, shift, name, style)
        column[1].set_xlabel(label)
        column[1].set_xticks(np.unique(np.concatenate([c.values for c in of_scenes.values()])))
    _finish(grid)
    handles, labels = grid[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper left", ncols=len(labels))
    return figure


def _draw(column: NDArray, curve: Curve, shift: float, name: str, style: dict[str, str]) -> None:
    values = np.unique(curve.values)
    groups = [curve.values == value for value in values]
    rates = [wilson(int(curve.located[group].sum()), int(group.sum())) for group in groups]
    middle = [np.median(curve.right[group]) for group in groups]
    shares, matches = column
    place = values + shift
    low, high = [rate.low for rate in rates], [rate.high for rate in rates]
    shares.vlines(place, low, high, color=style["color"], linewidth=0.9, alpha=0.6)
    share = [rate.share for rate in rates]
    shares.plot(place, share, label=name, linewidth=1.3, markersize=4, **style)
    matches.plot(place, middle, linewidth=1.3, markersize=4, **style)
    dots = curve.values + shift
    matches.plot(dots, curve.right, ".", color=style["color"], markersize=2.5, alpha=0.5)


def _finish(grid: NDArray) -> None:
    first: Axes = grid[0, 0]
    first.set_ylim(-0.03, 1.03)
    first.yaxis.set_major_formatter(PercentFormatter(1.0))
    first.set_ylabel("MAV located")
    grid[1, 0].set_yscale("symlog", linthresh=10)
    grid[1, 0].set_ylim(bottom=0)
    grid[1, 0].set_ylabel("right matches, median")
    for axes in grid.ravel():
        axes.grid(axis="y")

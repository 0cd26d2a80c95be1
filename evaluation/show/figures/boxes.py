"""Boxplots that keep failures: what has no number is counted above the axis."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter
from numpy.typing import ArrayLike, NDArray

from evaluation.show.figures.style import SMALL_PT
from evaluation.table.intervals import quantile, with_failures

MOST_TICKS = 14
TITLE_PAD_PT = 23
"""Above boxes, whose failures are counted between them and the title."""
NARROW = 0.4
"""Boxes narrower than this have no room for a count of two digits beside their neighbours'."""


def draw_box(axes: Axes, x: float, values: ArrayLike, width: float, colour: str) -> None:
    """One box on an axis whose limits are set: median, quartiles, whiskers, all outliers.

    Whiskers end at the last value within 1.5 interquartile ranges, as in the paper's
    figures. Failures count as infinite in the quartiles; a box that they reach is cut off
    at the top of the axis.

    Args:
        x: Where on the axis.
        values: (N,) with NaN or inf for failures.
        width: Of the box, in units of x.
    """
    array = with_failures(values)
    if len(array) == 0:
        return
    top = axes.get_ylim()[1]
    q25, median, q75 = (min(quantile(array, q), top) for q in (0.25, 0.5, 0.75))
    reach = 1.5 * (q75 - q25)
    finite = array[np.isfinite(array)]
    inside = finite[(finite >= q25 - reach) & (finite <= q75 + reach)]
    low = min(float(inside.min()), q25) if len(inside) else q25
    high = max(float(inside.max()), q75) if len(inside) else q75
    axes.vlines(x, low, q25, color=colour, linewidth=1.1)
    axes.vlines(x, q75, high, color=colour, linewidth=1.1)
    left = x - width / 2
    axes.fill_between([left, left + width], q25, q75, facecolor=colour, alpha=0.28, linewidth=0)
    axes.plot(
        [left, left + width, left + width, left, left],
        [q25, q25, q75, q75, q25],
        color=colour,
        linewidth=1.1,
    )
    axes.hlines(median, left, left + width, color=colour, linewidth=2.6)
    outliers = finite[(finite < low) | (finite > high)]
    axes.plot(
        np.full(len(outliers), x),
        outliers,
        linestyle="none",
        marker="o",
        markersize=2.8,
        markerfacecolor="none",
        markeredgecolor=colour,
        markeredgewidth=0.9,
    )
    failures = len(array) - len(finite)
    if failures:
        axes.annotate(
            f"{failures}✕",
            (x, 1.0),
            xycoords=("data", "axes fraction"),
            xytext=(0, 2),
            textcoords="offset points",
            ha="center",
            va="bottom",
            fontsize=SMALL_PT,
            color=colour,
            rotation=90 if width < NARROW else 0,
        )


def log_axis(axes: Axes, groups: list[ArrayLike], floor: float) -> None:
    """Logarithmic limits around the finite values, never below `floor`; plain tick labels."""
    pooled = np.concatenate([with_failures(g) for g in groups]) if groups else np.zeros(0)
    finite = pooled[np.isfinite(pooled)]
    low = max(float(finite.min()) / 1.3, floor) if len(finite) else floor
    high = float(finite.max()) * 1.3 if len(finite) else 10 * floor
    axes.set_yscale("log")
    axes.set_ylim(low, max(high, 10 * low))
    axes.yaxis.set_major_locator(LogLocator(base=10, subs=(1.0, 2.0, 5.0)))
    axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.yaxis.set_minor_formatter(NullFormatter())
    axes.grid(axis="y")


def positions(groups: int, group: int, width: float = 0.8) -> tuple[float, float]:
    """Offset and width of one of several boxes that share an integer position."""
    step = width / groups
    return -width / 2 + step * (group + 0.5), step * 0.78


def iteration_axis(axes: Axes, groups: list[NDArray[np.float64]]) -> None:
    """A horizontal axis of iterations for arrays of (sequences, iterations)."""
    last = max((group.shape[1] for group in groups), default=1)
    axes.set_xlim(0.4, last + 0.6)
    axes.set_xticks(range(1, last + 1, -(-last // MOST_TICKS)))
    axes.set_xlabel("iteration (aerial maps taken in)")

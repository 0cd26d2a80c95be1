"""Boxplots that keep failures: values that are missing are counted above the axis."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import LogLocator
from numpy.typing import ArrayLike, NDArray

from evaluation.show.figures.style import SMALL_PT, plain_numbers
from evaluation.table.intervals import quantile, with_failures

MOST_TICKS = 14
"""Iterations labelled at most; more labels would touch."""
TITLE_PAD_PT = 23
"""Distance from axes to title [pt], which leaves room for the counts of failures."""
NARROW = 0.4
"""Narrower boxes, in units of x, have no room for a horizontal count of two digits."""
FILLED = 0.78
"""Share of its place that a box fills."""


def draw_boxes(
    axes: Axes,
    groups: Mapping[str, Sequence[ArrayLike]],
    colours: Sequence[str],
    first: int = 1,
    span: float = 0.8,
) -> NDArray[np.float64]:
    """Boxes of several groups side by side, on an axis whose limits are set.

    Whiskers end at the last value within 1.5 interquartile ranges, as in the paper's figures,
    and every outlier is drawn. Failures count as infinite in the quartiles; a box that they
    reach ends at the top of the axis.

    Args:
        groups: Label of a group -> its boxes, one for each integer x from `first` on. A box is
            (N,) values, NaN or inf for failures.
        colours: Colour of each group.
        first: Integer x of the first box.
        span: Width shared by the boxes at one integer, in units of x.

    Returns:
        (groups, boxes) centres along x.
    """
    step = span / len(groups)
    width = FILLED * step
    centres = []
    for number, ((label, boxes), colour) in enumerate(zip(groups.items(), colours, strict=False)):
        x = first + np.arange(len(boxes)) - span / 2 + step * (number + 0.5)
        centres.append(x)
        arrays = {at: with_failures(box) for at, box in zip(x, boxes, strict=True)}
        filled = {at: array for at, array in arrays.items() if len(array)}
        _draw_group(axes, filled, width, colour)
        axes.plot([], [], color=colour, linewidth=6, alpha=0.6, label=label)
    return np.array(centres)


def _draw_group(
    axes: Axes, boxes: dict[float, NDArray[np.float64]], width: float, colour: str
) -> None:
    axes.bxp(
        [_statistics(array, axes.get_ylim()[1]) for array in boxes.values()],
        positions=list(boxes),
        widths=width,
        manage_ticks=False,
        showcaps=False,
        patch_artist=True,
        boxprops={"facecolor": (colour, 0.28), "edgecolor": colour, "linewidth": 1.1},
        whiskerprops={"color": colour, "linewidth": 1.1, "solid_capstyle": "butt"},
        medianprops={"color": colour, "linewidth": 2.6, "solid_capstyle": "butt"},
        flierprops={
            "marker": "o",
            "markersize": 2.8,
            "markerfacecolor": "none",
            "markeredgecolor": colour,
            "markeredgewidth": 0.9,
        },
    )
    for x, array in boxes.items():
        if failures := int(np.sum(~np.isfinite(array))):
            axes.annotate(
                f"{failures}✕", (x, 1.0), xycoords=("data", "axes fraction"), xytext=(0, 2),
                textcoords="offset points", ha="center", va="bottom", fontsize=SMALL_PT,
                color=colour, rotation=90 if width < NARROW else 0,
            )  # fmt: skip


def _statistics(array: NDArray[np.float64], top: float) -> dict[str, Any]:
    """One box for `Axes.bxp`: (N,) values, infinite for failures; quartiles end at `top`."""
    q25, median, q75 = (min(quantile(array, q), top) for q in (0.25, 0.5, 0.75))
    reach = 1.5 * (q75 - q25)
    finite = array[np.isfinite(array)]
    inside = finite[(finite >= q25 - reach) & (finite <= q75 + reach)]
    low, high = inside.min(initial=q25), inside.max(initial=q75)
    outliers = finite[(finite < low) | (finite > high)]
    return {
        "q1": q25,
        "med": median,
        "q3": q75,
        "whislo": low,
        "whishi": high,
        "fliers": outliers,
    }


def log_axis(axes: Axes, groups: Sequence[ArrayLike], floor: float) -> None:
    """Logarithmic limits around the finite values, never below `floor`; plain tick labels."""
    pooled = np.concatenate([with_failures(g) for g in groups]) if groups else np.zeros(0)
    finite = pooled[np.isfinite(pooled)]
    low = max(float(finite.min()) / 1.3, floor) if len(finite) else floor
    high = float(finite.max()) * 1.3 if len(finite) else 10 * floor
    axes.set_yscale("log")
    axes.set_ylim(low, max(high, 10 * low))
    axes.yaxis.set_major_locator(LogLocator(base=10, subs=(1.0, 2.0, 5.0)))
    plain_numbers(axes.yaxis)
    axes.grid(axis="y")


def iteration_axis(axes: Axes, groups: Sequence[NDArray[np.float64]]) -> None:
    """A horizontal axis of iterations for arrays of (sequences, iterations)."""
    last = max((group.shape[1] for group in groups), default=1)
    axes.set_xlim(0.4, last + 0.6)
    axes.set_xticks(range(1, last + 1, -(-last // MOST_TICKS)))
    axes.set_xlabel("iteration (number of aerial maps)")

"""Fig. 11 and 12: localization error and spread of the particles over the iterations."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from evaluation.setup import published
from evaluation.show.figures.boxes import (
    TITLE_PAD_PT,
    draw_box,
    iteration_axis,
    log_axis,
    positions,
)
from evaluation.show.figures.style import PAPER, SERIES, WIDE_IN, styled
from evaluation.table.intervals import rate_within


@styled
def localization_error_figure(
    errors: dict[str, NDArray[np.float64]], colours: Sequence[str] = SERIES
) -> Figure:
    """Boxplots above; below, the share of sequences within 0.5 and 0.25 m.

    Args:
        errors: Label of a condition -> (sequences, iterations) error [m], NaN or inf where the
            sequence failed.
        colours: One a condition.
    """
    figure = Figure(figsize=(WIDE_IN, 5.25), layout="constrained")
    boxes, near, close = figure.subplot_mosaic(
        [["boxes", "boxes"], ["near", "close"]], height_ratios=[1.5, 1]
    ).values()
    log_axis(boxes, list(errors.values()), floor=1e-3)
    boxes.set_ylim(top=max(boxes.get_ylim()[1], 0.65))
    for limit in (0.5, 0.25):
        boxes.axhline(limit, color=PAPER, linewidth=1.0, linestyle=(0, (5, 3)))
        boxes.text(
            1.005, limit, f"{limit:g} m", transform=boxes.get_yaxis_transform(), color=PAPER,
            va="center", fontsize=7.5,
        )  # fmt: skip
    for group, (label, error) in enumerate(errors.items()):
        offset, width = positions(len(errors), group)
        for iteration, values in enumerate(error.T, 1):
            draw_box(boxes, iteration + offset, values, width, colours[group])
        boxes.plot([], [], color=colours[group], linewidth=6, alpha=0.6, label=label)
    boxes.set_title(
        "error of the MAV's position relative to the ground robot [m]", pad=TITLE_PAD_PT
    )
    iteration_axis(boxes, list(errors.values()))
    figure.legend(loc="outside upper left")

    _success(near, errors, colours, 0.5, published.WITHIN_0_50_M_FIRST.value, at=1)
    _success(close, errors, colours, 0.25, published.WITHIN_0_25_M_FOURTH.value, at=4)
    return figure


def _success(
    axes: Axes,
    errors: dict[str, NDArray[np.float64]],
    colours: Sequence[str],
    limit: float,
    paper: float,
    at: int,
) -> None:
    """Share of sequences within `limit`, with Wilson intervals and the paper's one point."""
    for group, error in enumerate(errors.values()):
        iterations = np.arange(1.0, error.shape[1] + 1)
        rates = [rate_within(values, limit) for values in error.T]
        share = np.array([100 * rate.share for rate in rates])
        low = np.array([100 * rate.low for rate in rates])
        high = np.array([100 * rate.high for rate in rates])
        shift = 0.07 * (group - (len(errors) - 1) / 2)
        axes.fill_between(
            iterations + shift, low, high, color=colours[group], alpha=0.13, linewidth=0
        )
        axes.plot(
            iterations + shift, share, color=colours[group], marker="o", markersize=4, linewidth=1.6
        )
    axes.plot(at, 100 * paper, "D", color=PAPER, markersize=7, zorder=5, clip_on=False)
    axes.annotate(
        f"paper {paper:.0%}", (at, 100 * paper), xytext=(8, -4), textcoords="offset points",
        color=PAPER, va="top", fontsize=7.5, zorder=6,
        bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.75, "pad": 0.8},
    )  # fmt: skip
    axes.set_ylim(0, 103)
    axes.set_title(f"% of sequences within {limit:g} m")
    axes.grid(axis="y")
    iteration_axis(axes, list(errors.values()))


@styled
def spread_figure(
    spreads: dict[str, NDArray[np.float64]], colours: Sequence[str] = SERIES
) -> Figure:
    """Boxplots of the particles' standard deviation [m], as in Fig. 12.

    Args:
        spreads: Label of a condition -> (sequences, iterations) spread [m], NaN where there
            is no belief.
        colours: One a condition.
    """
    figure = Figure(figsize=(WIDE_IN, 3.3), layout="constrained")
    axes = figure.subplots()
    log_axis(axes, list(spreads.values()), floor=1e-3)
    for group, (label, spread) in enumerate(spreads.items()):
        offset, width = positions(len(spreads), group)
        for iteration, values in enumerate(spread.T, 1):
            draw_box(axes, iteration + offset, values, width, colours[group])
        axes.plot([], [], color=colours[group], linewidth=6, alpha=0.6, label=label)
    iteration_axis(axes, list(spreads.values()))
    axes.set_title("standard deviation of the particles [m]", pad=TITLE_PAD_PT)
    figure.legend(loc="outside upper left")
    return figure

"""Fig. 11 and 12: localization error and spread of the particles over the iterations."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from evaluation.setup import published
from evaluation.show.figures.boxes import TITLE_PAD_PT, draw_boxes, iteration_axis, log_axis
from evaluation.show.figures.style import LABEL_PT, PAPER, SERIES, WIDE_IN, reference_line, styled
from evaluation.table.intervals import rate_within
from evaluation.table.limits import FIRST_MAP, FOURTH_MAP, LOCATED_M, NEAR_M

PerSequence = dict[str, NDArray[np.float64]]
"""Label of a condition -> (sequences, iterations) values [m], NaN or inf for a failure."""


@styled
def localization_error_figure(errors: PerSequence, colours: Sequence[str] = SERIES) -> Figure:
    """Boxplots above; below, the share of sequences within 0.5 and 0.25 m."""
    figure = Figure(figsize=(WIDE_IN, 5.25), layout="constrained")
    boxes, near, close = figure.subplot_mosaic(
        [["boxes", "boxes"], ["near", "close"]], height_ratios=[1.5, 1]
    ).values()
    log_axis(boxes, list(errors.values()), floor=1e-3)
    boxes.set_ylim(top=max(boxes.get_ylim()[1], 0.65))
    for limit in (NEAR_M, LOCATED_M):
        reference_line(boxes, limit, f"{limit:g} m")
    title = "error of the MAV's position relative to the ground robot [m]"
    _boxes_over_iterations(boxes, errors, colours, title)
    figure.legend(loc="outside upper left")

    _success(near, errors, colours, NEAR_M, published.WITHIN_0_50_M_FIRST.value, at=FIRST_MAP)
    _success(close, errors, colours, LOCATED_M, published.WITHIN_0_25_M_FOURTH.value, at=FOURTH_MAP)
    return figure


@styled
def spread_figure(spreads: PerSequence, colours: Sequence[str] = SERIES) -> Figure:
    """Boxplots of the particles' standard deviation, as in Fig. 12."""
    figure = Figure(figsize=(WIDE_IN, 3.3), layout="constrained")
    axes = figure.subplots()
    log_axis(axes, list(spreads.values()), floor=1e-3)
    _boxes_over_iterations(axes, spreads, colours, "standard deviation of the particles [m]")
    figure.legend(loc="outside upper left")
    return figure


def _boxes_over_iterations(
    axes: Axes, values: PerSequence, colours: Sequence[str], title: str
) -> None:
    most = max(group.shape[1] for group in values.values())
    boxes = {
        # A run with fewer aerial maps than another has no boxes at the end.
        label: [*group.T, *(np.empty(0) for _ in range(most - group.shape[1]))]
        for label, group in values.items()
    }
    draw_boxes(axes, boxes, colours)
    iteration_axis(axes, list(values.values()))
    axes.set_title(title, pad=TITLE_PAD_PT)


def _success(
    axes: Axes, errors: PerSequence, colours: Sequence[str], limit: float, paper: float, at: int
) -> None:
    """Share of sequences within a limit [m], with Wilson intervals and the paper's one point."""
    for group, (error, colour) in enumerate(zip(errors.values(), colours, strict=False)):
        rates = [rate_within(values, limit) for values in error.T]
        share, low, high = (
            [100 * getattr(rate, part) for rate in rates] for part in ("share", "low", "high")
        )
        x = np.arange(1.0, len(rates) + 1) + 0.07 * (group - (len(errors) - 1) / 2)
        axes.fill_between(x, low, high, color=colour, alpha=0.13, linewidth=0)
        axes.plot(x, share, color=colour, marker="o", markersize=4, linewidth=1.6)
    axes.plot(at, 100 * paper, "D", color=PAPER, markersize=7, zorder=5, clip_on=False)
    axes.annotate(
        f"paper {paper:.0%}", (at, 100 * paper), xytext=(8, -4), textcoords="offset points",
        color=PAPER, va="top", fontsize=LABEL_PT, zorder=6,
        bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.75, "pad": 0.8},
    )  # fmt: skip
    axes.set_ylim(0, 103)
    axes.set_title(f"% of sequences within {limit:g} m")
    axes.grid(axis="y")
    iteration_axis(axes, list(errors.values()))

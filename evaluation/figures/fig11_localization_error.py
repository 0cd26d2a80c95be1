"""Fig. 11: the localization error over the iterations, and how many succeed."""

from __future__ import annotations

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from evaluation import published
from evaluation.figures.boxes import draw_box, log_axis, positions
from evaluation.figures.style import PAPER, SERIES, styled
from evaluation.statistics import rate_within


@styled
def localization_error_figure(errors: dict[str, pd.DataFrame]) -> Figure:
    """Boxplots above; below, the share of sequences within 0.5 and 0.25 m.

    Args:
        errors: Label of a condition -> error [m] per sequence (rows) and iteration
            (columns 1, 2, ...), NaN or inf where the sequence failed.
    """
    figure = Figure(figsize=(9.0, 6.6), layout="constrained")
    boxes, near, close = figure.subplot_mosaic(
        [["boxes", "boxes"], ["near", "close"]], height_ratios=[1.5, 1]
    ).values()
    log_axis(boxes, [frame.to_numpy() for frame in errors.values()], floor=1e-3)
    for limit in (0.5, 0.25):
        boxes.axhline(limit, color=PAPER, linewidth=1.0, linestyle=(0, (5, 3)))
        boxes.text(
            1.005, limit, f"{limit:g} m", transform=boxes.get_yaxis_transform(), color=PAPER,
            va="center", fontsize=9,
        )  # fmt: skip
    for group, (label, frame) in enumerate(errors.items()):
        offset, width = positions(len(errors), group)
        for iteration in frame.columns:
            draw_box(boxes, iteration + offset, frame[iteration], width, SERIES[group])
        boxes.plot([], [], color=SERIES[group], linewidth=6, alpha=0.6, label=label)
    boxes.set_title("error of the MAV's position relative to the ground robot [m]", pad=16)
    _iteration_axis(boxes, errors)
    figure.legend(loc="outside upper left", ncols=1, fontsize=9)

    _success(near, errors, 0.5, published.WITHIN_0_50_M_FIRST.value, at=1)
    _success(close, errors, 0.25, published.WITHIN_0_25_M_FOURTH.value, at=4)
    return figure


def _success(
    axes: Axes, errors: dict[str, pd.DataFrame], limit: float, paper: float, at: int
) -> None:
    """Share of sequences within `limit`, with Wilson intervals and the paper's one point."""
    for group, frame in enumerate(errors.values()):
        iterations = np.array(frame.columns, float)
        rates = [rate_within(frame[i], limit) for i in frame.columns]
        share = np.array([100 * rate.share for rate in rates])
        low = np.array([100 * rate.low for rate in rates])
        high = np.array([100 * rate.high for rate in rates])
        shift = 0.07 * (group - (len(errors) - 1) / 2)
        axes.fill_between(
            iterations + shift, low, high, color=SERIES[group], alpha=0.13, linewidth=0
        )
        axes.plot(
            iterations + shift, share, color=SERIES[group], marker="o", markersize=4, linewidth=1.6
        )
    axes.plot(at, 100 * paper, "D", color=PAPER, markersize=7, zorder=5, clip_on=False)
    axes.annotate(
        f"paper {paper:.0%}", (at, 100 * paper), xytext=(8, -4), textcoords="offset points",
        color=PAPER, va="top", fontsize=9,
    )  # fmt: skip
    axes.set_ylim(0, 103)
    axes.set_title(f"% of sequences within {limit:g} m")
    axes.grid(axis="y")
    _iteration_axis(axes, errors)


def _iteration_axis(axes: Axes, errors: dict[str, pd.DataFrame]) -> None:
    last = max((max(frame.columns, default=1) for frame in errors.values()), default=1)
    axes.set_xlim(0.4, last + 0.6)
    axes.set_xticks(range(1, last + 1))
    axes.set_xlabel("iteration (aerial maps taken in)")

"""Which stage loses what: the final error with each stage replaced by the truth."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from evaluation.figures.style import SERIES, WIDE_IN, styled
from evaluation.statistics.intervals import quantile


@styled
def error_budget_figure(
    errors: dict[str, tuple[NDArray[np.float64], NDArray[np.float64]]],
) -> Figure:
    """Median as a bar, quartiles as a whisker; the first row's median runs through all.

    Args:
        errors: What is true -> (N,) errors of position [m] and (N,) of angle [deg], NaN where
            the pose was not found.
    """
    figure = Figure(figsize=(WIDE_IN, 0.28 * len(errors) + 1.2), layout="constrained")
    left, right = figure.subplots(1, 2, sharey=True)
    _bars(left, [1e3 * metres for metres, _ in errors.values()], "position error [mm]")
    _bars(right, [degrees for _, degrees in errors.values()], "angle error [deg]")
    left.set_yticks(range(len(errors)), list(errors))
    left.set_ylim(len(errors) - 0.4, -0.6)
    left.set_title("the truth replaces ...", loc="left")
    return figure


def _bars(axes: Axes, groups: list[NDArray[np.float64]], label: str) -> None:
    medians = [quantile(group, 0.5) for group in groups]
    for row, (group, median) in enumerate(zip(groups, medians, strict=True)):
        if not np.isfinite(median):
            axes.text(0.0, row, " most fail", color=SERIES[0], va="center", fontsize=7.5)
            continue
        low, high = quantile(group, 0.25), quantile(group, 0.75)
        axes.barh(row, median, height=0.55, color=SERIES[0], alpha=0.75 if row else 1.0)
        axes.hlines(row, low, high if np.isfinite(high) else median, color="black", linewidth=1.2)
    if np.isfinite(medians[0]):
        axes.axvline(medians[0], color=SERIES[0], linewidth=1.0, linestyle=(0, (5, 3)))
    axes.set_xlim(left=0)
    axes.set_xlabel(f"{label}: median, quartiles")
    axes.grid(axis="x")

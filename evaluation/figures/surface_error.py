"""Error and completeness of the fused aerial surfaces, of conditions side by side."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from evaluation.figures.boxes import TITLE_PAD_PT, draw_box, log_axis
from evaluation.figures.style import SERIES, WIDE_IN, styled

Values = dict[str, NDArray[np.float64]]
"""Label of a condition -> (surfaces,) values, NaN where a surface has none."""


@styled
def surface_figure(
    median_m: Values, p90_m: Values, completeness: Values, colours: Sequence[str] = SERIES
) -> Figure:
    """Boxes over the surfaces of each one's median, 90th percentile, and share of pixels."""
    figure = Figure(figsize=(WIDE_IN, 2.7), layout="constrained")
    left, middle, right = figure.subplots(1, 3)
    for axes, groups, title in (
        (left, median_m, "median error [mm]"),
        (middle, p90_m, "90 % error [mm]"),
    ):
        millimetres = {label: 1e3 * values for label, values in groups.items()}
        log_axis(axes, list(millimetres.values()), floor=0.1)
        _boxes(axes, millimetres, title, colours)
    right.set_ylim(0, 103)
    right.grid(axis="y")
    percent = {label: 100 * values for label, values in completeness.items()}
    _boxes(right, percent, "pixels with depth [%]", colours)
    for label, colour in zip(median_m, colours, strict=False):
        left.plot([], [], color=colour, linewidth=6, alpha=0.6, label=label)
    figure.legend(loc="outside upper left")
    return figure


def _boxes(axes: Axes, groups: Values, title: str, colours: Sequence[str]) -> None:
    for x, (values, colour) in enumerate(zip(groups.values(), colours, strict=False)):
        draw_box(axes, x, values, 0.6, colour)
    axes.set_xlim(-0.6, len(groups) - 0.4)
    axes.set_xticks([])
    axes.set_title(title, pad=TITLE_PAD_PT)

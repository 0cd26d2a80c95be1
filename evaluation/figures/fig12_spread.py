"""Fig. 12: the spread of the particles over the iterations."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from evaluation.figures.boxes import TITLE_PAD_PT, draw_box, iteration_axis, log_axis, positions
from evaluation.figures.style import SERIES, WIDE_IN, styled


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

"""Fig. 12: the spread of the particles over the iterations."""

from __future__ import annotations

import pandas as pd
from matplotlib.figure import Figure

from evaluation.figures.boxes import draw_box, log_axis, positions
from evaluation.figures.style import SERIES, styled


@styled
def spread_figure(spreads: dict[str, pd.DataFrame]) -> Figure:
    """Boxplots of the particles' standard deviation [m], as in Fig. 12.

    Args:
        spreads: Label of a condition -> spread [m] per sequence (rows) and iteration
            (columns), NaN where there is no belief.
    """
    figure = Figure(figsize=(9.0, 4.2), layout="constrained")
    axes = figure.subplots()
    log_axis(axes, [frame.to_numpy() for frame in spreads.values()], floor=1e-3)
    for group, (label, frame) in enumerate(spreads.items()):
        offset, width = positions(len(spreads), group)
        for iteration in frame.columns:
            draw_box(axes, iteration + offset, frame[iteration], width, SERIES[group])
        axes.plot([], [], color=SERIES[group], linewidth=6, alpha=0.6, label=label)
    last = max((max(frame.columns, default=1) for frame in spreads.values()), default=1)
    axes.set_xlim(0.4, last + 0.6)
    axes.set_xticks(range(1, last + 1))
    axes.set_xlabel("iteration (aerial maps taken in)")
    axes.set_title("standard deviation of the particles [m]", pad=16)
    figure.legend(loc="outside upper left", fontsize=9)
    return figure

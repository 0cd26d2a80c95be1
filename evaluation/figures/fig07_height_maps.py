"""Fig. 7: the two height maps and the cost of every relative position."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray
from scipy.ndimage import binary_closing, binary_fill_holes

from evaluation.figures.maps import draw_costs, draw_grid, mark_truth
from evaluation.figures.style import HEIGHT_COLOURS, PAPER, WIDE_IN, styled
from evaluation.showcase.showcase import Showcase


@styled
def height_maps_figure(showcase: Showcase) -> Figure:
    """Aerial map, ground map with the aerial footprint at the best u, cost map."""
    figure = Figure(figsize=(WIDE_IN, 3.3), layout="compressed")
    aerial_axes, ground_axes, cost_axes = figure.subplots(1, 3)
    aerial, ground = showcase.aerial_heights, showcase.ground_heights
    step = showcase.steps[0]

    low, high = np.nanpercentile(aerial.heights, [1, 99])
    span = max(high - low, 0.05)
    for axes, made, title in (
        (aerial_axes, aerial, "a  aerial height map"),
        (ground_axes, ground, "b  ground height map"),
    ):
        # One span for both: a colour is a height above the floor, and walls do not fade the heap.
        low = np.nanpercentile(made.heights, 1)
        shown = draw_grid(
            axes,
            made.heights,
            made.origin,
            made.cells_per_m,
            HEIGHT_COLOURS,
            vmin=low,
            vmax=low + span,
        )
        figure.colorbar(shown, ax=axes, label="height [m]", location="bottom", extend="max")
        axes.set_title(title)
    best = step.cost_map.best()
    if best is not None:
        _footprint(ground_axes, showcase, best)
    mark_truth(ground_axes, step.true_u)

    cost_map = step.cost_map
    shown = draw_costs(cost_axes, cost_map.costs, cost_map.origin, cost_map.cells_per_m)
    units = {"zmssd": "ZMSSD [m²]", "ncc": "1 - correlation"}
    label = units.get(cost_map.cost, cost_map.cost)
    figure.colorbar(shown, ax=cost_axes, label=label, location="bottom", extend="max")
    cost_axes.set_title("c  cost of every position u")
    if best is not None:
        cost_axes.plot(
            *best,
            "o",
            markersize=9,
            markerfacecolor="none",
            markeredgecolor=PAPER,
            markeredgewidth=1.4,
            linestyle="none",
            label="lowest cost",
        )
    mark_truth(cost_axes, step.true_u)
    cost_axes.legend(loc="upper right", frameon=True, framealpha=0.9)
    for axes in (aerial_axes, ground_axes, cost_axes):
        axes.set_xlabel("x [m]")
    aerial_axes.set_ylabel("y [m]")
    return figure


def _footprint(axes: Axes, showcase: Showcase, u: NDArray) -> None:
    """Outline of what the MAV saw, put where u says it is."""
    aerial = showcase.aerial_heights
    seen = np.pad(np.isfinite(aerial.heights), 2)
    seen = binary_fill_holes(binary_closing(seen, iterations=2))
    index = np.stack(np.meshgrid(*(np.arange(n) - 2 for n in seen.shape), indexing="ij"), axis=-1)
    points = aerial.origin + index / aerial.cells_per_m - showcase.aerial_reference
    c, s = np.cos(showcase.aerial_heading), np.sin(showcase.aerial_heading)
    x = u[0] + c * points[..., 0] - s * points[..., 1]
    y = u[1] + s * points[..., 0] + c * points[..., 1]
    axes.contour(x, y, seen.astype(float), levels=[0.5], colors=[PAPER], linewidths=1.2)

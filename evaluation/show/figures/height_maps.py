"""Fig. 7: the two height maps and the cost of every relative position."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import Colormap
from matplotlib.figure import Figure
from matplotlib.image import AxesImage
from numpy.typing import ArrayLike, NDArray
from scipy.ndimage import binary_closing, binary_fill_holes

from evaluation.measure.showcase import Showcase
from evaluation.show.figures.style import (
    COST_COLOURS,
    HEIGHT_COLOURS,
    PAPER,
    WIDE_IN,
    colour_map,
    styled,
)


def draw_grid(
    axes: Axes,
    cells: NDArray,
    origin: NDArray,
    cells_per_m: float,
    cmap: str | Colormap,
    **limits: Any,
) -> AxesImage:
    """Draw (nx, ny) cells so that x runs right and y up, both in metres."""
    half = 0.5 / cells_per_m
    last = origin + (np.array(cells.shape) - 1) / cells_per_m
    extent = (origin[0] - half, last[0] + half, origin[1] - half, last[1] + half)
    return axes.imshow(
        cells.T,
        origin="lower",
        extent=extent,
        cmap=colour_map(cmap),
        interpolation="nearest",
        **limits,
    )


def draw_costs(axes: Axes, costs: NDArray, origin: NDArray, cells_per_m: float) -> AxesImage:
    """Costs in grey, low is dark (as in the paper); the worst tenth is clipped."""
    finite = costs[np.isfinite(costs)]
    low, high = (finite.min(), np.percentile(finite, 90)) if len(finite) else (0.0, 1.0)
    return draw_grid(axes, costs, origin, cells_per_m, COST_COLOURS, vmin=low, vmax=high)


def mark_truth(axes: Axes, u: ArrayLike, label: str | None = "true position") -> None:
    """A black cross on white: visible on any ground."""
    x, y = np.asarray(u)
    axes.plot(x, y, "+", color="white", markersize=10, markeredgewidth=3.2, zorder=5)
    axes.plot(
        x,
        y,
        "+",
        color="black",
        markersize=9.5,
        markeredgewidth=1.3,
        zorder=6,
        linestyle="none",
        label=label,
    )


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
    points = aerial.origin + index / aerial.cells_per_m
    x, y = u[0] + points[..., 0], u[1] + points[..., 1]
    axes.contour(x, y, seen.astype(float), levels=[0.5], colors=[PAPER], linewidths=1.2)

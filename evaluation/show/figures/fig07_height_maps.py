"""Fig. 7: the two height maps and the cost of every relative position."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import Colormap
from matplotlib.figure import Figure
from matplotlib.image import AxesImage
from numpy.typing import ArrayLike, NDArray
from scipy.ndimage import binary_closing, binary_fill_holes

from airground.core.belief import CostMap, HeightMap
from evaluation.measure.showcase import Showcase
from evaluation.show.figures.style import (
    COST_COLOURS,
    HEIGHT_COLOURS,
    HOLE,
    PAPER,
    WIDE_IN,
    colour_map,
    styled,
    value_range,
)

COST_UNITS = {
    "zmssd": "ZMSSD [m²]",
    "ncc": "1 - correlation",
    "likelihood": "ln likelihood ratio",
    "channels": "ln likelihood ratio",
}


@styled
def height_maps_figure(showcase: Showcase) -> Figure:
    """Aerial map, ground map with the aerial footprint at the best u, cost map."""
    figure = Figure(figsize=(WIDE_IN, 3.5), layout="constrained")
    aerial_axes, ground_axes, cost_axes = figure.subplots(1, 3)
    aerial, ground = seen_part(showcase.aerial_heights), seen_part(showcase.ground_heights)
    step = showcase.steps[0]

    low, high = value_range(aerial.heights, 1, 99)
    span = max(high - low, 0.05)
    for axes, made, title in (
        (aerial_axes, aerial, "a  aerial height map"),
        (ground_axes, ground, "b  ground height map"),
    ):
        # One span for both: a colour is a height above the floor, and walls do not fade the heap.
        low, _ = value_range(made.heights, 1, 99)
        limits = {"vmin": low, "vmax": low + span}
        shown = draw_grid(
            axes, made.heights, made.origin, made.cells_per_m, HEIGHT_COLOURS, **limits
        )
        figure.colorbar(shown, ax=axes, label="height [m]", location="bottom", extend="max")
        axes.set_title(title)
    mark_truth(ground_axes, step.true_u)

    shown = draw_costs(cost_axes, step.cost_map)
    label = COST_UNITS.get(step.cost_map.cost, step.cost_map.cost)
    figure.colorbar(shown, ax=cost_axes, label=label, location="bottom", extend="max")
    cost_axes.set_title("c  cost of every position u")
    best = step.cost_map.best()
    if best is not None:
        _footprint(ground_axes, aerial, best)
        cost_axes.plot(
            *best, "o", markersize=9, markerfacecolor="none", markeredgecolor=PAPER,
            markeredgewidth=1.4, linestyle="none", label="lowest cost",
        )  # fmt: skip
    mark_truth(cost_axes, step.true_u)
    figure.legend(*cost_axes.get_legend_handles_labels(), loc="outside lower right", ncols=2)
    for axes in (aerial_axes, ground_axes, cost_axes):
        axes.set_xlabel("x [m]")
        square_panel(axes)
    aerial_axes.set_ylabel("y [m]")
    return figure


def seen_part(made: HeightMap) -> HeightMap:
    """The map within the smallest rectangle that has all its heights: rooms are larger."""
    seen = np.argwhere(np.isfinite(made.heights))
    if len(seen) == 0:
        return made
    first, last = seen.min(axis=0), seen.max(axis=0)
    cells = made.heights[first[0] : last[0] + 1, first[1] : last[1] + 1]
    return replace(made, heights=cells, origin=made.origin + first / made.cells_per_m)


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


def square_panel(axes: Axes) -> None:
    """Widen the shorter axis of a grid, so that panels of any extent have the same width."""
    axes.set_box_aspect(1)
    axes.set_adjustable("datalim")
    axes.set_facecolor(HOLE)


def draw_costs(axes: Axes, made: CostMap) -> AxesImage:
    """Costs in grey, low is dark (as in the paper); the highest tenth is clipped."""
    low, high = value_range(made.costs, 0, 90)
    return draw_grid(
        axes, made.costs, made.origin, made.cells_per_m, COST_COLOURS, vmin=low, vmax=high
    )


def mark_truth(axes: Axes, u: ArrayLike) -> None:
    """A black cross on white at the true position: visible on any colour."""
    x, y = np.asarray(u)
    axes.plot(x, y, "+", color="white", markersize=10, markeredgewidth=3.2, zorder=5)
    axes.plot(
        x, y, "+", color="black", markersize=9.5, markeredgewidth=1.3, zorder=6,
        linestyle="none", label="true position",
    )  # fmt: skip


def _footprint(axes: Axes, aerial: HeightMap, u: NDArray) -> None:
    """Outline of the cells seen by the MAV, with its reference camera at u."""
    seen = np.pad(np.isfinite(aerial.heights), 2)
    seen = binary_fill_holes(binary_closing(seen, iterations=2))
    x, y = (
        u[axis] + aerial.origin[axis] + (np.arange(seen.shape[axis]) - 2) / aerial.cells_per_m
        for axis in (0, 1)
    )
    axes.contour(x, y, seen.T.astype(float), levels=[0.5], colors=[PAPER], linewidths=1.2)

"""Grids in metres: cells are [ix, iy] until the moment they are drawn."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import Colormap
from matplotlib.image import AxesImage
from numpy.typing import ArrayLike, NDArray

from evaluation.figures.style import COST_COLOURS, colour_map


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

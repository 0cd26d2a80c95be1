"""What a claim was made from: the two height maps, laid over each other where it was claimed."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from airground.core.height_map import make_height_map
from evaluation.show.figures.fig07_height_maps import draw_grid
from evaluation.show.figures.style import ERROR_COLOURS, HEIGHT_COLOURS, PAPER, WIDE_IN, styled
from tests.negatives.campaign import Try

CELLS_PER_M = 50.0
SPAN_M = 0.6
"""Range of the colours of heights [m]."""
OFF_M = 0.1
"""Range of the colours of differences, to both sides [m]."""


@styled
def tries_figure(tries: Sequence[Try]) -> Figure:
    """A row for each try: the ground map with the outline of the newest aerial map at the belief's
    place, that map, and their difference where both have heights."""
    figure = Figure(figsize=(WIDE_IN, 0.6 + 2.2 * len(tries)), layout="constrained")
    rows = figure.subplots(len(tries), 3, squeeze=False)
    for panels, one in zip(rows, tries, strict=True):
        laid = one.belief.T_ground_mav @ one.view.aerial
        low, high = laid[:, :2].min(axis=0) - 0.5, laid[:, :2].max(axis=0) + 0.5
        ground = make_height_map(one.view.ground, CELLS_PER_M, window=(low, high))
        aerial = make_height_map(laid, CELLS_PER_M, window=(low, high))
        difference = aerial.heights - ground.heights
        floor = float(np.nanpercentile(aerial.heights, 2))
        of_heights = {"vmin": floor, "vmax": floor + SPAN_M}
        shown = draw_grid(
            panels[0], ground.heights, ground.origin, CELLS_PER_M, HEIGHT_COLOURS, **of_heights
        )
        draw_grid(
            panels[1], aerial.heights, aerial.origin, CELLS_PER_M, HEIGHT_COLOURS, **of_heights
        )
        off = draw_grid(
            panels[2], difference, aerial.origin, CELLS_PER_M, ERROR_COLOURS,
            vmin=-OFF_M, vmax=OFF_M,
        )  # fmt: skip
        x = aerial.origin[0] + np.arange(aerial.heights.shape[0]) / CELLS_PER_M
        y = aerial.origin[1] + np.arange(aerial.heights.shape[1]) / CELLS_PER_M
        seen = np.isfinite(aerial.heights).T.astype(float)
        panels[0].contour(x, y, seen, levels=[0.5], colors=PAPER, linewidths=1.0)
        outcome = one.outcome
        panels[0].set_title(f"#{outcome.number} {outcome.kind}, map {outcome.step}")
        panels[1].set_title("claimed" if outcome.claimed else "best guess, refused")
        panels[2].set_title("difference")
        for axes in panels:
            axes.set_aspect("equal")
            axes.set_xlim(x[0], x[-1])
            axes.set_ylim(y[0], y[-1])
        panels[0].set_ylabel("y [m]")
    for axes in rows[-1]:
        axes.set_xlabel("x [m]")
    below: dict[str, Any] = {"location": "bottom", "extend": "both", "shrink": 0.6}
    figure.colorbar(shown, ax=rows[:, :2], label="height [m]", **below)
    figure.colorbar(off, ax=rows[:, 2], label="aerial minus ground [m]", **below)
    return figure

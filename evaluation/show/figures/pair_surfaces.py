"""Surfaces of a run without truth: depth beside measured depth, and their place in the map."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from airground.core.height_map import make_height_map
from evaluation.run.surface_log import AgainstMeasured, LoggedSurface
from evaluation.show.figures.fig07_height_maps import draw_grid
from evaluation.show.figures.style import (
    DEPTH_COLOURS,
    ERROR_COLOURS,
    FAINT,
    HEIGHT_COLOURS,
    HOLE,
    SMALL_PT,
    WIDE_IN,
    colour_map,
    picture_axes,
    styled,
    value_range,
)

CELLS_PER_M = 25.0
"""Resolution of the height maps [cells/m]: that of the pipeline's own."""
AROUND_M = 0.5
"""Ground map that is shown around an aerial surface [m]."""
LIMIT_MM = 100.0
"""End of the error's colour scale [mm]."""


@styled
def depth_figure(surfaces: Sequence[LoggedSurface]) -> Figure:
    """A row per surface: reference view, fused depth, measured depth, fused minus measured."""
    figure = Figure(figsize=(WIDE_IN, 1.5 * len(surfaces) + 0.6), layout="constrained")
    rows = figure.subplots(len(surfaces), 4, squeeze=False)
    known = [one.surface.depth if one.measured is None else one.measured for one in surfaces]
    low, high = value_range(np.concatenate([depth.ravel() for depth in known]), 1, 99)
    depths: dict[str, Any] = {
        "cmap": colour_map(DEPTH_COLOURS, hole=FAINT),
        "vmin": low,
        "vmax": high,
    }
    errors: dict[str, Any] = {
        "cmap": colour_map(ERROR_COLOURS, hole=FAINT), "vmin": -LIMIT_MM, "vmax": LIMIT_MM
    }  # fmt: skip
    for row, logged in zip(rows, surfaces, strict=True):
        view, fused, measured, error = row
        view.imshow(logged.image, cmap="gray", vmin=0, vmax=255)
        shown = fused.imshow(logged.surface.depth, **depths)
        fused.set_title(f"fused from {logged.surface.depth_maps}")
        if logged.measured is not None and logged.error is not None:
            measured.imshow(logged.measured, **depths)
            wrong = error.imshow(1e3 * logged.error, **errors)
            error.set_title(_error_title(logged), fontsize=SMALL_PT, fontweight="normal")
            measured.set_title("measured")
        view.set_title("reference view")
        for axes in row:
            picture_axes(axes)
    bars: dict[str, Any] = {"location": "bottom", "extend": "both", "shrink": 0.8, "aspect": 40}
    figure.colorbar(shown, ax=rows[:, :3], label="depth [m]", **bars)
    if any(logged.measured is not None for logged in surfaces):
        figure.colorbar(wrong, ax=rows[:, 3], label="difference [mm]", **bars)
    return figure


@styled
def place_figure(surfaces: Sequence[LoggedSurface]) -> Figure:
    """A column per surface: the ground robot's heights, and those of the surface at its place."""
    figure = Figure(figsize=(WIDE_IN, 4.2), layout="constrained")
    columns = figure.subplots(2, len(surfaces), squeeze=False).T
    for (ground, aerial), logged in zip(columns, surfaces, strict=True):
        ground.set_title(_short(logged.outcome), fontsize=SMALL_PT)
        if logged.ground_cloud is None or logged.T_ground_mav is None:
            picture_axes(ground)
            picture_axes(aerial)
            continue
        _draw_place(ground, aerial, logged)
    for axes, name in zip(columns[0], ("ground robot's map", "aerial surface"), strict=True):
        axes.set_ylabel(f"{name}, y [m]")
    for _, aerial in columns:
        aerial.set_xlabel("x [m]")
    return figure


def _draw_place(ground: Axes, aerial: Axes, logged: LoggedSurface) -> None:
    """Both height maps over the same square, in the same colours."""
    assert logged.ground_cloud is not None
    assert logged.T_ground_mav is not None
    laid = make_height_map(logged.T_ground_mav @ logged.surface.cloud_mav.points, CELLS_PER_M)
    last = laid.origin + (np.array(laid.heights.shape) - 1) / CELLS_PER_M
    window = (laid.origin - AROUND_M, last + AROUND_M)
    around = make_height_map(logged.ground_cloud.points, CELLS_PER_M, window=window)
    low, high = value_range(around.heights, 1, 99)
    for axes, made in ((ground, around), (aerial, laid)):
        draw_grid(axes, made.heights, made.origin, CELLS_PER_M, HEIGHT_COLOURS, vmin=low, vmax=high)
        axes.set_facecolor(HOLE)
        axes.set_xlim(window[0][0], window[1][0])
        axes.set_ylim(window[0][1], window[1][1])


def _error_title(logged: LoggedSurface) -> str:
    found = AgainstMeasured.of(logged)
    if found is None:
        return "no pixel in common"
    size = f"median {1e3 * found.median_m:.0f}, 90 % {1e3 * found.p90_m:.0f} mm"
    return f"{size}\n{found.completeness:.0%} of the pixels"


def _short(outcome: str) -> str:
    """The kind of a reason."""
    return outcome.partition(":")[0]

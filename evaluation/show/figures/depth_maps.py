"""Fig. 6: depth maps and the fused surface; errors and completeness of fused surfaces."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from evaluation.measure.showcase import Showcase
from evaluation.show.figures.boxes import TITLE_PAD_PT, draw_box, log_axis
from evaluation.show.figures.style import (
    DEPTH_COLOURS,
    ERROR_COLOURS,
    FAINT,
    SERIES,
    SMALL_PT,
    WIDE_IN,
    colour_map,
    picture_axes,
    styled,
)

SHOWN = 3
"""Single depth maps shown beside the fused one."""


@styled
def depth_maps_figure(showcase: Showcase) -> Figure:
    """Depth above; below it the signed error, and on the left how its size is distributed."""
    columns = min(SHOWN, len(showcase.depth_maps)) + 2
    figure = Figure(figsize=(WIDE_IN, 1.7 * WIDE_IN / columns + 0.4), layout="constrained")
    axes = figure.subplots(2, columns)
    depths = [made.depth for made in showcase.depth_maps[: columns - 2]] + [showcase.surface.depth]
    errors = [*showcase.depth_errors[: columns - 2], showcase.surface_error]
    titles = [f"depth map {i + 1}" for i in range(columns - 2)]
    titles.append(f"fused from {showcase.surface.depth_maps}")

    axes[0, 0].imshow(showcase.depth_maps[0].image, cmap="gray", vmin=0, vmax=255)
    axes[0, 0].set_title("reference view")
    picture_axes(axes[0, 0])
    low, high = np.nanpercentile(np.concatenate([d.ravel() for d in depths]), [1, 99])
    depth_colours = colour_map(DEPTH_COLOURS, hole=FAINT)
    limit_mm = _robust_limit_mm(errors[-1])
    for column, (depth, error, title) in enumerate(zip(depths, errors, titles, strict=True), 1):
        shown = axes[0, column].imshow(depth, cmap=depth_colours, vmin=low, vmax=high)
        axes[0, column].set_title(title)
        wrong = axes[1, column].imshow(
            1e3 * error, cmap=colour_map(ERROR_COLOURS, hole=FAINT), vmin=-limit_mm, vmax=limit_mm
        )
        axes[1, column].set_title(_error_title(error), fontsize=SMALL_PT, fontweight="normal")
        picture_axes(axes[0, column])
        picture_axes(axes[1, column])
    figure.colorbar(shown, ax=axes[0, :], label="depth [m]", shrink=0.85, pad=0.01)
    bar = figure.colorbar(wrong, ax=axes[1, 1:], extend="both", shrink=0.85, pad=0.01)
    bar.set_label("depth minus true [mm]")
    _distribution(axes[1, 0], errors)
    return figure


def completeness(error: NDArray) -> float:
    """Share of the pixels that have a depth."""
    return float(np.isfinite(error).mean())


def _error_title(error: NDArray) -> str:
    size = 1e3 * np.abs(error[np.isfinite(error)])
    if len(size) == 0:
        return "nothing seen"
    median, p90 = np.percentile(size, [50, 90])
    return f"median {median:.1f} mm\n90 %: {p90:.0f} mm\n{completeness(error):.0%} of pixels"


def _robust_limit_mm(error: NDArray) -> float:
    size = 1e3 * np.abs(error[np.isfinite(error)])
    wide = float(np.percentile(size, 95)) if len(size) else 20.0
    return float(np.clip(np.ceil(wide / 5) * 5, 10, 60))


def _distribution(axes: Axes, errors: list[NDArray]) -> None:
    """Share of all pixels within an error: tells accuracy and completeness at once."""
    steps_mm = np.geomspace(1, 200, 80)
    for error in errors[:-1]:
        axes.plot(steps_mm, _share_within(error, steps_mm), color=FAINT, linewidth=1.0)
    axes.plot(steps_mm, _share_within(errors[-1], steps_mm), color=SERIES[0], linewidth=2.2)
    axes.text(
        0.03, 0.97, "fused", transform=axes.transAxes, color=SERIES[0], va="top", weight="bold"
    )
    axes.text(0.03, 0.86, "single", transform=axes.transAxes, color=FAINT, va="top", weight="bold")
    axes.set_xscale("log")
    axes.set_xticks([1, 10, 100], ["1", "10", "100"])
    axes.set_ylim(0, 100)
    axes.set_xlabel("error up to [mm]", fontsize=7.5)
    axes.set_title("% of pixels within", fontsize=7.5, fontweight="normal")
    axes.grid()


def _share_within(error: NDArray, steps_mm: NDArray) -> NDArray:
    ordered = np.sort(1e3 * np.abs(error[np.isfinite(error)]))
    return 100 * np.searchsorted(ordered, steps_mm, side="right") / error.size


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

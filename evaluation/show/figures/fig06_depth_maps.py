"""Fig. 6: depth maps and the fused surface; errors and completeness of fused surfaces."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from evaluation.measure.showcase import Showcase
from evaluation.show.figures.boxes import TITLE_PAD_PT, draw_boxes, log_axis
from evaluation.show.figures.style import (
    DEPTH_COLOURS,
    ERROR_COLOURS,
    FAINT,
    LABEL_PT,
    SERIES,
    SMALL_PT,
    WIDE_IN,
    colour_map,
    picture_axes,
    styled,
    value_range,
)

SHOWN = 3
"""Single depth maps beside the fused one: as many as fit in one row."""


@styled
def depth_maps_figure(showcase: Showcase) -> Figure:
    """Depth above; below it the signed error, and on the left the distribution of its size."""
    singles = min(SHOWN, len(showcase.depth_maps))
    depths = [made.depth for made in showcase.depth_maps[:singles]] + [showcase.surface.depth]
    errors = [*showcase.depth_errors[:singles], showcase.surface_error]
    titles = [f"depth map {i + 1}" for i in range(singles)]
    titles.append(f"fused from {showcase.surface.depth_maps}")

    columns = singles + 2
    figure = Figure(figsize=(WIDE_IN, 1.7 * WIDE_IN / columns + 0.4), layout="constrained")
    axes = figure.subplots(2, columns)
    axes[0, 0].imshow(showcase.depth_maps[0].image, cmap="gray", vmin=0, vmax=255)
    axes[0, 0].set_title("reference view")
    low, high = value_range(np.concatenate([depth.ravel() for depth in depths]), 1, 99)
    limit_mm = _error_limit_mm(errors[-1])
    for column, (depth, error, title) in enumerate(zip(depths, errors, titles, strict=True), 1):
        shown = axes[0, column].imshow(
            depth, cmap=colour_map(DEPTH_COLOURS, hole=FAINT), vmin=low, vmax=high
        )
        axes[0, column].set_title(title)
        wrong = axes[1, column].imshow(
            1e3 * error, cmap=colour_map(ERROR_COLOURS, hole=FAINT), vmin=-limit_mm, vmax=limit_mm
        )
        axes[1, column].set_title(_error_title(error), fontsize=SMALL_PT, fontweight="normal")
        picture_axes(axes[1, column])
    for picture in axes[0]:
        picture_axes(picture)
    figure.colorbar(shown, ax=axes[0, :], label="depth [m]", shrink=0.85, pad=0.01)
    bar = figure.colorbar(wrong, ax=axes[1, 1:], extend="both", shrink=0.85, pad=0.01)
    bar.set_label("depth minus true [mm]")
    _distribution(axes[1, 0], errors)
    return figure


def completeness(error: NDArray) -> float:
    """Share of the pixels that have a depth."""
    return float(np.isfinite(error).mean())


def _size_mm(error: NDArray) -> NDArray:
    """(N,) absolute error of the pixels that have one [mm]."""
    return 1e3 * np.abs(error[np.isfinite(error)])


def _error_title(error: NDArray) -> str:
    size = _size_mm(error)
    if len(size) == 0:
        return "no depth"
    median, p90 = np.percentile(size, [50, 90])
    return f"median {median:.1f} mm\n90 %: {p90:.0f} mm\n{completeness(error):.0%} of pixels"


def _error_limit_mm(error: NDArray) -> float:
    """End of the error's colour scale: 95 % of the pixels, in steps of 5 mm from 10 to 60."""
    size = _size_mm(error)
    wide = float(np.percentile(size, 95)) if len(size) else 20.0
    return float(np.clip(np.ceil(wide / 5) * 5, 10, 60))


def _distribution(axes: Axes, errors: list[NDArray]) -> None:
    """Share of all pixels within an error, which shows accuracy and completeness at once."""
    steps_mm = np.geomspace(1, 200, 80)
    for number, error in enumerate(errors, 1):
        fused = number == len(errors)
        within = np.searchsorted(np.sort(_size_mm(error)), steps_mm, side="right")
        colour, width = (SERIES[0], 2.2) if fused else (FAINT, 1.0)
        axes.plot(steps_mm, 100 * within / error.size, color=colour, linewidth=width)
    for y, text, colour in ((0.97, "fused", SERIES[0]), (0.86, "single", FAINT)):
        axes.text(0.03, y, text, transform=axes.transAxes, color=colour, va="top", weight="bold")
    axes.set_xscale("log")
    axes.set_xticks([1, 10, 100], ["1", "10", "100"])
    axes.set_ylim(0, 100)
    axes.set_xlabel("error up to [mm]", fontsize=LABEL_PT)
    axes.set_title("% of pixels within", fontsize=LABEL_PT, fontweight="normal")
    axes.grid()


Values = dict[str, NDArray[np.float64]]
"""Label of a condition -> (surfaces,) values, NaN where a surface has none."""


@styled
def surface_figure(
    median_m: Values, p90_m: Values, completeness: Values, colours: Sequence[str] = SERIES
) -> Figure:
    """Boxes over the surfaces of each one's median, 90th percentile, and share of pixels."""
    figure = Figure(figsize=(WIDE_IN, 2.7), layout="constrained")
    panels = figure.subplots(1, 3)
    for axes, groups, scale, title in (
        (panels[0], median_m, 1e3, "median error [mm]"),
        (panels[1], p90_m, 1e3, "90 % error [mm]"),
        (panels[2], completeness, 100, "pixels with depth [%]"),
    ):
        boxes = {label: [scale * values] for label, values in groups.items()}
        if groups is completeness:
            axes.set_ylim(0, 103)
            axes.grid(axis="y")
        else:
            log_axis(axes, [values for (values,) in boxes.values()], floor=0.1)
        draw_boxes(axes, boxes, colours)
        axes.set_xlim(0.5, 1.5)
        axes.set_xticks([])
        axes.set_title(title, pad=TITLE_PAD_PT)
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside upper left")
    return figure

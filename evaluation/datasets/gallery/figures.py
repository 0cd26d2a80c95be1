"""Figures of a dataset: paths from above, and statistics over all recordings."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from evaluation.datasets.gallery.statistics import Recorded
from evaluation.show.figures.style import (
    COLUMN_IN,
    SERIES,
    ReportFigure,
    colour_map,
    styled,
    value_range,
)

COLOUR = {"mav": SERIES[0], "ground": SERIES[1]}
NAMES = {"mav": "MAV", "ground": "ground robot"}
CELL_M = 0.05
"""Side of the cells of the true surface seen from above [m]."""
HEIGHT_GREYS = "gist_yarg"
BINS = 30


@styled
def from_above(
    name: str, robots: Sequence[Recorded], surface_world: NDArray[np.float64] | None
) -> ReportFigure | None:
    """Paths of the cameras from above, over the true surface where it is known.

    Args:
        name: Name of the recording.
        robots: What each robot recorded.
        surface_world: (N, 3) points of the true surface [m]; None without.

    Returns:
        The figure; None if no robot has truth.
    """
    paths = {one.robot: one.path_world for one in robots if one.path_world is not None}
    if not paths:
        return None
    figure = Figure(figsize=(COLUMN_IN, 3.1), layout="constrained")
    axes = figure.subplots()
    if surface_world is not None:
        heights, extent = highest(surface_world)
        low, high = value_range(heights, 1, 90)
        axes.imshow(
            heights.T,
            origin="lower",
            extent=extent,
            cmap=colour_map(HEIGHT_GREYS, "white"),
            vmin=low,
            vmax=low + 1.6 * (high - low),  # the paths stay visible on the highest places
        )
    for robot, path in paths.items():
        axes.plot(path[:, 0], path[:, 1], color=COLOUR[robot], linewidth=1.4, label=NAMES[robot])
        known = path[np.isfinite(path).all(axis=1)]
        axes.plot(*known[:1, :2].T, "o", color=COLOUR[robot], markersize=5)
    axes.set(xlabel="x [m]", ylabel="y [m]", aspect="equal")
    axes.set_adjustable("datalim" if surface_world is None else "box")
    figure.legend(loc="outside upper center", ncols=len(paths))
    caption = "True paths of the cameras; a dot is the first image."
    if surface_world is not None:
        caption += " Grey: the true surface, the darker the higher."
    return ReportFigure(f"above-{name}", "From above", caption, figure, wide=False)


def highest(
    points: NDArray[np.float64],
) -> tuple[NDArray[np.float64], tuple[float, float, float, float]]:
    """(nx, ny) greatest z [m] of points (N, 3) in cells of `CELL_M`, NaN without, and the borders
    x0, x1, y0, y1 [m]."""
    low = np.floor(points[:, :2].min(axis=0) / CELL_M) * CELL_M
    cells = np.floor((points[:, :2] - low) / CELL_M).astype(int)
    heights = np.full(cells.max(axis=0) + 1, -np.inf)
    np.maximum.at(heights, (cells[:, 0], cells[:, 1]), points[:, 2])
    high = low + np.array(heights.shape) * CELL_M
    heights[np.isneginf(heights)] = np.nan
    return heights, (float(low[0]), float(high[0]), float(low[1]), float(high[1]))


def statistics(
    robots: Sequence[Recorded], shared: Sequence[NDArray[np.float64]]
) -> list[ReportFigure]:
    """Distributions over all recordings; those of which nothing is known are left out.

    Args:
        robots: What each robot of each recording recorded.
        shared: For each recording with both robots and truth, the shares of `shared_with_ground`.
    """
    both = ("mav", "ground")

    def of(attribute: str, scale: float = 1.0) -> dict[str, NDArray[np.float64]]:
        found = {
            robot: [scale * getattr(one, attribute) for one in robots if one.robot == robot]
            for robot in both
        }
        return {robot: np.concatenate(values) for robot, values in found.items() if values}

    drawn = (
        _histogram("speed", "Motion: speed", "speed of the camera [m/s]", of("speed_m_s")),
        _histogram("turning", "Motion: turning", "rate of rotation [deg/s]", of("turn_deg_s")),
        _histogram(
            "overlap",
            "Overlap with the image a second later",
            "share of the pixels [%]",
            of("overlap", 100.0),
        ),
        _histogram(
            "shared",
            "Overlap with the ground robot",
            "share of a MAV image that the ground robot sees [%]",
            {"mav": 100 * np.concatenate([np.zeros(0), *shared])},
        ),
        _histogram("light", "Light", "mean grey level of an image", of("mean_grey")),
    )
    return [figure for figure in drawn if figure is not None]


@styled
def _histogram(
    name: str, title: str, label: str, values: dict[str, NDArray[np.float64]]
) -> ReportFigure | None:
    """Shares of the values of each robot, its median as a line; None without a finite value."""
    finite = {robot: each[np.isfinite(each)] for robot, each in values.items()}
    finite = {robot: each for robot, each in finite.items() if len(each)}
    if not finite:
        return None
    high = max(each.max() for each in finite.values())
    edges = np.linspace(0, high if high > 0 else 1.0, BINS + 1)
    if "%" in label:
        edges = np.linspace(0, 100, BINS + 1)
    elif "grey" in label:
        edges = np.linspace(0, 255, BINS + 1)
    figure = Figure(figsize=(COLUMN_IN, 2.1), layout="constrained")
    axes = figure.subplots()
    for robot, each in finite.items():
        weights = np.full(len(each), 100 / len(each))
        colour = COLOUR[robot]
        axes.hist(
            each, edges.tolist(), weights=weights, histtype="stepfilled", alpha=0.35, color=colour,
            label=NAMES[robot],
        )  # fmt: skip
        axes.axvline(float(np.median(each)), color=colour, linewidth=1.4)
    axes.set(xlabel=label, ylabel="share [%]", xlim=(edges[0], edges[-1]))
    axes.grid(axis="y")
    figure.legend(loc="outside upper right", ncols=len(finite))
    medians = ", ".join(f"{NAMES[robot]} {np.median(each):.3g}" for robot, each in finite.items())
    caption = f"Lines are medians: {medians}. Values: {sum(map(len, finite.values()))}."
    return ReportFigure(name, title, caption, figure, wide=False)

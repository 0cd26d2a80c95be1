"""Fig. 5 and 15: the augmented map; and a cut through both maps before and after refinement."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from airground.core.se3 import SE3
from evaluation.measure.showcase import Showcase
from evaluation.show.figures.scene_pictures import GROUND_COLOUR, GROUND_PATH, MAV_COLOUR, MAV_PATH
from evaluation.show.figures.style import INK, WIDE_IN, picture_axes, styled


@styled
def augmented_figure(robot_view: NDArray[np.uint8], aerial_view: NDArray[np.uint8]) -> Figure:
    """Two rendered pictures, (height, width, 3) each, with a legend."""
    height, width = robot_view.shape[:2]
    figure = Figure(figsize=(WIDE_IN, WIDE_IN / 2 * height / width + 0.6), layout="constrained")
    titles = ("a  from the ground robot's side", "b  from the aerial side")
    for axes, picture, title in zip(
        figure.subplots(1, 2), (robot_view, aerial_view), titles, strict=True
    ):
        axes.imshow(picture)
        axes.set_title(title)
        picture_axes(axes)
    figure.legend(handles=_legend(), loc="outside lower center", ncols=4)
    return figure


def _legend() -> list[Line2D]:
    def entry(colour: tuple[int, int, int], label: str, **style: object) -> Line2D:
        return Line2D([], [], color=np.array(colour) / 255, label=label, **style)  # type: ignore[arg-type]

    dots = {"marker": "o", "linestyle": "none", "markersize": 8}
    return [
        entry(GROUND_COLOUR, "ground robot's map", **dots),
        entry(MAV_COLOUR, "added by the MAV", **dots),
        entry(GROUND_PATH, "ground robot's path", linewidth=3),
        entry(MAV_PATH, "MAV's path", linewidth=3),
    ]


CUT_M = 0.03
"""Thickness of the cut."""
ABOVE_FLOOR_M = 0.1
"""The cut goes where both maps have most points higher than this."""


@styled
def refinement_figure(showcase: Showcase, T_ground_mav: SE3) -> Figure:
    """Both maps cut along x, the aerial one where the particles have it and where ICP puts it.

    Args:
        showcase: With the surface and the first belief.
        T_ground_mav: The refined alignment of its surface.
    """
    aerial, ground = showcase.surface.cloud_mav.points, showcase.ground_cloud.points
    y = _liveliest_cut(ground, T_ground_mav @ aerial)
    figure = Figure(figsize=(WIDE_IN, 3.9), layout="constrained")
    panels = figure.subplots(2, 1, sharex=True, sharey=True)
    placed = (
        ("before refinement: where the particles put it", showcase.steps[0].belief.T_ground_mav),
        ("after refinement", T_ground_mav),
    )
    for axes, (title, where) in zip(panels, placed, strict=True):
        _draw(axes, where @ aerial, y, INK, 7, "aerial surface")
        _draw(axes, ground, y, np.array(GROUND_COLOUR) / 255, 4, "ground robot's map")
        axes.set(title=title, ylabel="z [m]", aspect="equal")
    x, z = _cut(T_ground_mav @ aerial, y)[:, [0, 2]].T
    if len(x):
        panels[0].set_xlim(x.min() - 0.3, x.max() + 0.3)
        panels[0].set_ylim(z.min() - 0.1, z.max() + 0.15)
    panels[1].set_xlabel("x [m]")
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside upper right", ncols=2)
    return figure


def _draw(axes: Axes, points: NDArray, y: float, colour: Any, size: float, label: str) -> None:
    x, z = _cut(points, y)[:, [0, 2]].T
    axes.scatter(x, z, s=size, color=colour, linewidths=0, label=label)


def _cut(points: NDArray, y: float) -> NDArray:
    return points[np.abs(points[:, 1] - y) < CUT_M / 2]


def _liveliest_cut(ground: NDArray, aerial: NDArray) -> float:
    """The y at which most of what stands above the floor is in both maps."""
    low, high = aerial.min(axis=0), aerial.max(axis=0)
    above = np.percentile(aerial[:, 2], 5) + ABOVE_FLOOR_M
    x_edges, y_edges = (np.arange(low[i], high[i] + 2 * CUT_M, CUT_M) for i in (0, 1))

    def filled(points: NDArray) -> NDArray:
        x, y = points[points[:, 2] > above, :2].T
        return np.histogram2d(x, y, bins=[x_edges, y_edges])[0] > 0

    shared = (filled(ground) & filled(aerial)).sum(axis=0)
    return float(y_edges[shared.argmax()] + CUT_M / 2)

"""Fig. 5 and 15: the augmented map; and a cut through both maps before and after refinement."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from airground.core.se3 import SE3
from evaluation.measure.showcase import Showcase
from evaluation.show.figures.scene_pictures import (
    BACKGROUND,
    GROUND_COLOUR,
    GROUND_PATH,
    MAV_COLOUR,
    MAV_PATH,
    Colour,
)
from evaluation.show.figures.style import INK, WIDE_IN, picture_axes, styled

CUT_M = 0.03
"""Thickness of the cut: about that of a few points of either map."""
ADDED, BELIEVED = "added by the MAV", "aerial surface where last believed, not added"
MARGIN_PX = 20
"""Background around what a picture shows [px]."""
FLATTEST = 2.0
"""Largest width over height of a picture: flatter ones would be small beside each other."""
ABOVE_FLOOR_M = 0.1
"""Points higher than this belong to the heap: well above the noise of the floor."""


@styled
def augmented_figure(
    robot_view: NDArray[np.uint8], aerial_view: NDArray[np.uint8], aerial: str = ADDED
) -> Figure:
    """Two rendered pictures, (height, width, 3) each, with a legend; `aerial` names the points of
    the MAV in it."""
    pictures = [_without_margins(view) for view in (robot_view, aerial_view)]
    aspects = [picture.shape[1] / picture.shape[0] for picture in pictures]
    figure = Figure(figsize=(WIDE_IN, WIDE_IN / sum(aspects) + 0.6), layout="constrained")
    titles = ("a  from the ground robot's side", "b  from the aerial side")
    panels = figure.subplots(1, 2, width_ratios=aspects)
    for axes, picture, title in zip(panels, pictures, titles, strict=True):
        axes.imshow(picture)
        axes.set_title(title)
        picture_axes(axes)
    dot: dict[str, Any] = {"marker": "o", "linestyle": "none", "markersize": 8}
    line: dict[str, Any] = {"linewidth": 3}
    entries = [
        Line2D([], [], color=_share(colour), label=label, **look)
        for colour, label, look in (
            (GROUND_COLOUR, "ground robot's map", dot),
            (MAV_COLOUR, aerial, dot),
            (GROUND_PATH, "ground robot's path", line),
            (MAV_PATH, "MAV's path", line),
        )
    ]
    figure.legend(handles=entries, loc="outside lower center", ncols=4)
    return figure


def as_believed(showcase: Showcase) -> Showcase:
    """With the first aerial surface where the last belief places it, instead of added points."""
    T_ground_mav = showcase.steps[-1].belief.T_ground_mav
    surface = showcase.surface.cloud_mav
    points = (T_ground_mav @ surface.points).astype(np.float32)
    return replace(showcase, aerial_cloud=replace(surface, points=points))


def _without_margins(picture: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """The part that shows something, with a margin, at least as high as wide by `FLATTEST`."""
    drawn = (picture != np.array(BACKGROUND, np.uint8)).any(axis=2)
    if not drawn.any():
        return picture
    spans = []
    for axis, length in ((1, picture.shape[0]), (0, picture.shape[1])):
        filled = np.flatnonzero(drawn.any(axis=axis))
        spans.append([max(filled[0] - MARGIN_PX, 0), min(filled[-1] + 1 + MARGIN_PX, length)])
    (top, bottom), (left, right) = spans
    missing = int((right - left) / FLATTEST) - (bottom - top)
    if missing > 0:
        top = max(top - missing, 0)
    return picture[top:bottom, left:right]


@styled
def refinement_figure(showcase: Showcase, T_ground_mav: SE3) -> Figure:
    """Both maps cut along x, with the aerial surface as placed by the particles and by ICP."""
    aerial, ground = showcase.surface.cloud_mav.points, showcase.ground_cloud.points
    y = _fullest_cut(ground, T_ground_mav @ aerial)
    figure = Figure(figsize=(WIDE_IN, 3.9), layout="constrained")
    panels = figure.subplots(2, 1, sharex=True, sharey=True)
    for axes, title, T in (
        (panels[0], "before refinement: as placed by the particles",
         showcase.steps[0].belief.T_ground_mav),
        (panels[1], "after refinement", T_ground_mav),
    ):  # fmt: skip
        for points, colour, size, label in (
            (T @ aerial, INK, 7, "aerial surface"),
            (ground, _share(GROUND_COLOUR), 4, "ground robot's map"),
        ):
            x, z = _cut(points, y)
            axes.scatter(x, z, s=size, color=colour, linewidths=0, label=label)
        axes.set(title=title, ylabel="z [m]", aspect="equal")
    x, z = _cut(T_ground_mav @ aerial, y)
    if len(x):
        panels[0].set_xlim(x.min() - 0.3, x.max() + 0.3)
        panels[0].set_ylim(z.min() - 0.1, z.max() + 0.15)
    panels[1].set_xlabel("x [m]")
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside upper right", ncols=2)
    return figure


def _share(colour: Colour) -> tuple[float, float, float]:
    """A colour of 0 to 255 as matplotlib reads it, of 0 to 1."""
    red, green, blue = colour
    return red / 255, green / 255, blue / 255


def _cut(points: NDArray, y: float) -> NDArray:
    """(2, N) x and z of the points (N, 3) near a plane of constant y."""
    return points[np.abs(points[:, 1] - y) < CUT_M / 2][:, [0, 2]].T


def _fullest_cut(ground: NDArray, aerial: NDArray) -> float:
    """The y at which most cells above the floor are filled in both maps."""
    low, high = aerial.min(axis=0), aerial.max(axis=0)
    above = np.percentile(aerial[:, 2], 5) + ABOVE_FLOOR_M
    x_edges, y_edges = (np.arange(low[i], high[i] + 2 * CUT_M, CUT_M) for i in (0, 1))

    def filled(points: NDArray) -> NDArray:
        x, y = points[points[:, 2] > above, :2].T
        return np.histogram2d(x, y, bins=[x_edges, y_edges])[0] > 0

    shared = (filled(ground) & filled(aerial)).sum(axis=0)
    return float(y_edges[shared.argmax()] + CUT_M / 2)

"""Fig. 5 and 15: the augmented map from the robot's side and from above."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from evaluation.figures.style import WIDE_IN, picture_axes, styled
from evaluation.showcase.scene_pictures import GROUND_COLOUR, GROUND_PATH, MAV_COLOUR, MAV_PATH


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

"""Fig. 2 and 3: images of both robots, and feature matches between them."""

from __future__ import annotations

import numpy as np
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from numpy.typing import NDArray

from evaluation.measure.baselines.matched_images import MatchedImages
from evaluation.measure.protocol.trials import spread_evenly
from evaluation.show.figures.style import PAPER, SERIES, WIDE_IN, picture_axes, styled

GAP_PX = 16
DRAWN = 120
"""Lines of a kind at most, spread evenly over the matches: more would hide the images."""
AGREEING, OTHERS = SERIES[2], PAPER


@styled
def views_figure(mav_image: NDArray[np.uint8], ground_image: NDArray[np.uint8]) -> Figure:
    """Two images of equal height: (h, w) grey or (h, w, 3) RGB each."""
    aspects = [image.shape[1] / image.shape[0] for image in (mav_image, ground_image)]
    figure = Figure(figsize=(WIDE_IN, WIDE_IN / sum(aspects) + 0.3), layout="constrained")
    panels = figure.subplots(1, 2, width_ratios=aspects)
    titles = ("from the MAV, looking down", "from the ground robot")
    for axes, image, title in zip(panels, (mav_image, ground_image), titles, strict=True):
        axes.imshow(image, cmap="gray", vmin=0, vmax=255)
        axes.set_title(title)
        picture_axes(axes)
    return figure


@styled
def matches_figure(matched: MatchedImages) -> Figure:
    """Both images side by side; green lines agree with one pose, thin red ones do not."""
    picture, shift = _side_by_side(matched.aerial, matched.ground)
    height = WIDE_IN * picture.shape[0] / picture.shape[1] + 0.35
    figure = Figure(figsize=(WIDE_IN, height), layout="constrained")
    axes = figure.subplots()
    axes.imshow(picture, cmap="gray", vmin=0, vmax=255)
    lines = np.stack([matched.aerial_px, matched.ground_px + shift], axis=1)
    for chosen, colour, width, opacity in (
        (~matched.agrees, OTHERS, 0.35, 0.4),
        (matched.agrees, AGREEING, 0.5, 0.8),
    ):
        ends = lines[chosen]
        ends = ends[spread_evenly(len(ends), DRAWN)]
        axes.add_collection(
            LineCollection(list(ends), colors=colour, linewidths=width, alpha=opacity)
        )
        axes.plot(*ends.reshape(-1, 2).T, ".", color=colour, alpha=opacity, markersize=1.6)
    axes.set_xlim(-0.5, picture.shape[1] - 0.5)
    axes.set_ylim(picture.shape[0] - 0.5, -0.5)
    axes.set_title(
        f"MAV (left) and ground robot (right): {len(lines)} matches, "
        f"{int(matched.agrees.sum())} agree on one pose"
    )
    picture_axes(axes)
    return figure


def _side_by_side(
    left: NDArray[np.uint8], right: NDArray[np.uint8]
) -> tuple[NDArray[np.uint8], NDArray[np.float64]]:
    """One picture with a white gap, and the place of the right image's pixel (0, 0) in it."""
    height = max(left.shape[0], right.shape[0])
    start = left.shape[1] + GAP_PX
    picture = np.full((height, start + right.shape[1]), 255, np.uint8)
    picture[: left.shape[0], : left.shape[1]] = left
    picture[: right.shape[0], start:] = right
    return picture, np.array([start, 0.0])

"""Fig. 2: what the two robots see of the same scene."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from evaluation.figures.style import WIDE_IN, picture_axes, styled


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

"""Fig. 13 and 14: translation and angular error before and after refinement."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from textwrap import fill

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import ArrayLike

from evaluation.setup import published
from evaluation.show.figures.boxes import TITLE_PAD_PT, draw_boxes, log_axis
from evaluation.show.figures.style import COLUMN_IN, DASHED, PAPER, SERIES, SMALL_PT, styled
from evaluation.table.intervals import quantile, with_failures

LABEL_LETTERS = 44
"""Letters that a line of the legend holds in a figure of one column."""


@dataclass(frozen=True)
class BeforeAfter:
    """Errors of the same trials before and after; NaN or inf where refinement failed."""

    before: ArrayLike
    after: ArrayLike


Trials = dict[str, BeforeAfter]
"""Label of a condition -> errors of its trials."""


def refinement_translation_figure(trials: Trials, colours: Sequence[str] = SERIES) -> Figure:
    """Translation errors [m], beside the paper's median of 0.076 m."""
    paper = published.REFINEMENT_TRANSLATION_M.value
    return _before_after_figure(trials, colours, "translation error [m]", paper, "m", 5e-4)


def refinement_angle_figure(trials: Trials, colours: Sequence[str] = SERIES) -> Figure:
    """Angles (angle-axis) [deg], beside the paper's median of 3.0 deg."""
    paper = published.REFINEMENT_ROTATION_DEG.value
    return _before_after_figure(trials, colours, "angular error [deg]", paper, "deg", 5e-3)


@styled
def _before_after_figure(
    trials: Trials, colours: Sequence[str], title: str, paper: float, unit: str, floor: float
) -> Figure:
    """Boxes before and after, with the paper's median after refinement as a line."""
    figure = Figure(figsize=(COLUMN_IN, 3.8), layout="constrained")
    axes = figure.subplots()
    boxes = {
        fill(label, LABEL_LETTERS): (pair.before, pair.after) for label, pair in trials.items()
    }
    log_axis(axes, [errors for pair in boxes.values() for errors in pair], floor)
    low, high = axes.get_ylim()
    crowded = len(boxes) > 2
    axes.set_ylim(min(low / (4 if crowded else 1.4), paper / 2), max(high, paper * 2))
    centres = draw_boxes(axes, boxes, colours, first=0, span=0.7)
    for x, pair in zip(centres, boxes.values(), strict=True):
        for at, errors in zip(x, pair, strict=True):
            _write_median(axes, at, errors, rotation=90 if crowded else 0)
    axes.plot([0.55, 1.45], [paper, paper], color=PAPER, linewidth=1.6, linestyle=DASHED)
    axes.text(1.52, paper, f"paper\n{paper:g} {unit}", color=PAPER, ha="left", va="center")
    axes.set_xlim(-0.5, 1.5)
    axes.set_xticks([0, 1], ["before ICP", "after ICP"])
    axes.set_title(title, pad=TITLE_PAD_PT)
    figure.legend(loc="outside upper left")
    return figure


def _write_median(axes: Axes, x: float, values: ArrayLike, rotation: float) -> None:
    """The median as text below the lowest value, where it covers nothing."""
    finite = with_failures(values)
    finite = finite[np.isfinite(finite)]
    if len(finite):
        lowest = max(float(finite.min()), axes.get_ylim()[0])
        axes.annotate(
            f"{quantile(values, 0.5):.2g}", (x, lowest), xytext=(0, -3), ha="center", va="top",
            textcoords="offset points", fontsize=SMALL_PT, weight="bold", rotation=rotation,
        )  # fmt: skip

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
from evaluation.show.figures.boxes import TITLE_PAD_PT, draw_box, log_axis, positions
from evaluation.show.figures.style import COLUMN_IN, PAPER, SERIES, SMALL_PT, styled
from evaluation.table.intervals import quantile, with_failures

LABEL_LETTERS = 44
"""A line of the legend holds so many."""


@dataclass(frozen=True)
class BeforeAfter:
    """Errors of the same trials before and after; NaN or inf where refinement failed."""

    before: ArrayLike
    after: ArrayLike


@styled
def before_after_figure(
    trials: dict[str, BeforeAfter],
    title: str,
    paper: float,
    unit: str,
    floor: float,
    colours: Sequence[str] = SERIES,
) -> Figure:
    """One group of boxes before, one after; the paper's median after as a line.

    Args:
        trials: Label of a condition -> its errors.
        title: What is drawn, with its unit.
        paper: The paper's median after refinement, in the unit of the errors.
        unit: For the line's label.
        floor: Smallest value on the axis.
        colours: One a condition.
    """
    figure = Figure(figsize=(COLUMN_IN, 3.8), layout="constrained")
    axes = figure.subplots()
    log_axis(axes, [e for pair in trials.values() for e in (pair.before, pair.after)], floor)
    low, high = axes.get_ylim()
    axes.set_ylim(min(low / 1.4, paper / 2), max(high, paper * 2))
    for group, (label, pair) in enumerate(trials.items()):
        offset, width = positions(len(trials), group, 0.7)
        for x, values in ((0, pair.before), (1, pair.after)):
            draw_box(axes, x + offset, values, width, colours[group])
            _write_median(axes, x + offset, values)
        axes.plot(
            [], [], color=colours[group], linewidth=6, alpha=0.6, label=fill(label, LABEL_LETTERS)
        )
    axes.plot([0.55, 1.45], [paper, paper], color=PAPER, linewidth=1.6, linestyle=(0, (5, 3)))
    axes.text(1.52, paper, f"paper\n{paper:g} {unit}", color=PAPER, ha="left", va="center")
    axes.set_xlim(-0.5, 1.5)
    axes.set_xticks([0, 1], ["before ICP", "after ICP"])
    axes.set_title(title, pad=TITLE_PAD_PT)
    figure.legend(loc="outside upper left")
    return figure


def _write_median(axes: Axes, x: float, values: ArrayLike) -> None:
    """The median in figures, under the lowest value so that it hides nothing."""
    finite = with_failures(values)
    finite = finite[np.isfinite(finite)]
    if len(finite):
        lowest = max(float(finite.min()), axes.get_ylim()[0])
        axes.annotate(
            f"{quantile(values, 0.5):.2g}", (x, lowest), xytext=(0, -3), ha="center", va="top",
            textcoords="offset points", fontsize=SMALL_PT, weight="bold",
        )  # fmt: skip


def refinement_translation_figure(
    trials: dict[str, BeforeAfter], colours: Sequence[str] = SERIES
) -> Figure:
    """Label of a condition -> translation errors [m]; the paper's median is 0.076 m."""
    paper = published.REFINEMENT_TRANSLATION_M.value
    return before_after_figure(
        trials, "translation error [m]", paper, "m", floor=5e-4, colours=colours
    )


def refinement_angle_figure(
    trials: dict[str, BeforeAfter], colours: Sequence[str] = SERIES
) -> Figure:
    """Label of a condition -> angles (angle-axis) [deg]; the paper's median is 3.0 deg."""
    paper = published.REFINEMENT_ROTATION_DEG.value
    return before_after_figure(
        trials, "angular error [deg]", paper, "deg", floor=5e-3, colours=colours
    )

"""Fig. 14: the angular error before and after refinement."""

from __future__ import annotations

from collections.abc import Sequence

from matplotlib.figure import Figure

from evaluation.figures.before_after import BeforeAfter, before_after_figure
from evaluation.figures.style import SERIES
from evaluation.report import published


def refinement_angle_figure(
    trials: dict[str, BeforeAfter], colours: Sequence[str] = SERIES
) -> Figure:
    """Label of a condition -> angles (angle-axis) [deg]; the paper's median is 3.0 deg."""
    paper = published.REFINEMENT_ROTATION_DEG.value
    return before_after_figure(
        trials, "angular error [deg]", paper, "deg", floor=5e-3, colours=colours
    )

"""Fig. 13: the translation error before and after refinement."""

from __future__ import annotations

from collections.abc import Sequence

from matplotlib.figure import Figure

from evaluation.figures.before_after import BeforeAfter, before_after_figure
from evaluation.figures.style import SERIES
from evaluation.report import published


def refinement_translation_figure(
    trials: dict[str, BeforeAfter], colours: Sequence[str] = SERIES
) -> Figure:
    """Label of a condition -> translation errors [m]; the paper's median is 0.076 m."""
    paper = published.REFINEMENT_TRANSLATION_M.value
    return before_after_figure(
        trials, "translation error [m]", paper, "m", floor=5e-4, colours=colours
    )

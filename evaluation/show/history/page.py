"""`history.html`: accuracy over revisions on one self-contained page."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from evaluation.judge.history.series import WINDOW, History
from evaluation.judge.verdict import ALPHA, Verdict
from evaluation.show.history.dashboards import write_dashboards
from evaluation.show.history.figures import history_figure
from evaluation.show.history.tables import revisions, steps_table, totals_table
from evaluation.show.report.page import rendered, saved_picture
from evaluation.table.steps import NOISE_FACTOR

PAGE = "history.html"


def write_history(out: Path, found: History) -> None:
    """Write the page, `figures/` (PNG and PDF) and the files for dashboards into an existing
    folder."""
    drawn = [series for series in found.series if not np.isnan(series.values).all()]
    stepped, still = (
        [
            saved_picture(history_figure(series, found), out)
            for series in drawn
            if bool(series.steps) == has_steps
        ]
        for has_steps in (True, False)
    )
    page = rendered(
        "history.html.j2",
        first=found.points[0],
        last=found.points[-1],
        count=len(found.points),
        suite=found.suite,
        condition=found.condition.label() if found.condition else "",
        left_out=found.left_out,
        figures_only=sum(not point.samples for point in found.points),
        counts=_counts(found),
        steps=steps_table(found),
        totals=totals_table(found),
        revisions=revisions(found),
        stepped=stepped,
        still=still,
        window=WINDOW,
        alpha=f"{ALPHA:g}",
        noise_factor=f"{NOISE_FACTOR:g}",
    )
    (out / PAGE).write_text(page, encoding="utf-8")
    write_dashboards(out, found)


def conclusion(found: History) -> str:
    """The history in one sentence."""
    counts = _counts(found)
    words = [f"{count} {verdict}" for verdict, count in counts.items() if count]
    return f"{len(found.points)} revisions; steps: {', '.join(words) or 'none'}"


def _counts(found: History) -> dict[str, int]:
    """Number of steps by verdict."""
    verdicts = (Verdict.WORSE, Verdict.BETTER, Verdict.SLIGHTLY_WORSE, Verdict.SLIGHTLY_BETTER)
    steps = found.steps()
    return {str(one): sum(step.verdict == one for step in steps) for one in verdicts}

"""Success against level: results of several levels of difficulty beside each other."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from evaluation.judge.claims import TO_BE_FOUND, localization_claims
from evaluation.judge.metrics import METRICS
from evaluation.judge.readings import rate
from evaluation.judge.results import AtLevel
from evaluation.setup.text import MISSING, TextTable
from evaluation.show.figures.style import COLUMN_IN, SERIES, ReportFigure, styled
from evaluation.table.intervals import Rate
from evaluation.table.rows import ResultTable

SUCCESS = METRICS["within_25cm_4"]
PRESETS = ("best", "paper", "paper_literal")


def level_table(levels: Sequence[AtLevel]) -> TextTable:
    """One row per level, one column per preset on its own SLAM; no rows for fewer than two levels.
    Each cell: sequences within 0.25 m after four maps, and wrong claims below."""
    if len(levels) < 2:
        return TextTable((), ())
    presets = _presets(levels)
    rows = [(str(one.level), *(_cell(_of(one, preset)) for preset in presets)) for one in levels]
    return TextTable(("level", *presets), tuple(rows))


@styled
def level_figures(levels: Sequence[AtLevel]) -> list[ReportFigure]:
    """The same as a figure with intervals; none for fewer than two levels."""
    if len(levels) < 2:
        return []
    figure = Figure(figsize=(COLUMN_IN, 2.6), layout="constrained")
    axes = figure.subplots()
    presets = _presets(levels)
    for index, (preset, colour) in enumerate(zip(presets, SERIES, strict=False)):
        tables = [_of(one, preset) for one in levels]
        rates = [(place, rate(SUCCESS, t)) for place, t in enumerate(tables) if t is not None]
        places = np.array([place for place, _ in rates]) + 0.08 * (index - (len(presets) - 1) / 2)
        shares = np.array([100 * found.share for _, found in rates])
        ends = np.array([[100 * found.low, 100 * found.high] for _, found in rates]).T
        spans = np.abs(ends - shares)
        axes.errorbar(places, shares, spans, color=colour, marker="o", capsize=2, label=preset)
    axes.set_xticks(range(len(levels)), [str(one.level) for one in levels])
    axes.set(ylim=(-3, 103), ylabel=f"{SUCCESS.title} [%]")
    axes.legend()
    caption = (
        f"Sequences {SUCCESS.title} at each level, poses from SLAM, with 95 % Wilson intervals; "
        "docs/levels.md says what makes each level."
    )
    return [ReportFigure("levels", "Success against level", caption, figure, wide=False)]


def _presets(levels: Sequence[AtLevel]) -> list[str]:
    return [name for name in PRESETS if any(_of(one, name) is not None for one in levels)]


def _of(one: AtLevel, preset: str) -> ResultTable | None:
    """The rows of a preset on its own SLAM: those of its first condition."""
    for condition in one.table.conditions():
        if (condition.preset, condition.poses) == (preset, "slam"):
            return one.table.of(condition).scored()
    return None


def _cell(table: ResultTable | None) -> str:
    if table is None:
        return MISSING
    claims = localization_claims(table).get(TO_BE_FOUND)
    wrong: Rate | None = None if claims is None else claims.wrong
    below = "" if wrong is None else f"\nwrong claims: {wrong.successes} of {wrong.total}"
    return rate(SUCCESS, table).text() + below

"""Success against level: every method at several levels of difficulty beside each other."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib import colormaps
from matplotlib.figure import Figure
from numpy.typing import NDArray

from evaluation.judge.claims import TO_BE_FOUND, localization_claims
from evaluation.judge.metrics import HEADING_DEG, METRICS
from evaluation.judge.readings import median, rate
from evaluation.judge.results import AtLevel
from evaluation.measure.baselines.table import BASELINES
from evaluation.setup.text import MISSING, TextTable, metres, milliseconds
from evaluation.show.figures.style import COLUMN_IN, SERIES, WIDE_IN, ReportFigure, styled
from evaluation.show.report.baselines import baseline_trials
from evaluation.table.intervals import Rate, quantile, wilson
from evaluation.table.limits import FOURTH_MAP, LOCATED_M
from evaluation.table.rows import ResultTable

SUCCESS, POSED = METRICS["within_25cm_4"], METRICS["posed_4"]
PRESETS = ("best", "paper", "paper_literal")
PER_MAP = ("cost_map", "particles")
"""Stages of ours that work once an aerial map."""


@dataclass(frozen=True)
class Achieved:
    """What a method achieved at a level.

    Attributes:
        success: Best guesses within 0.25 m of the truth.
        posed: Those that are also within 3 deg of the true heading, or turn.
        error_m: Median horizontal error of the best guess [m]; infinite where most have none.
        wrong: Claims beyond 0.25 m, of all claims.
        ms: Median time per aerial map [ms].
    """

    success: Rate
    posed: Rate
    error_m: float
    wrong: Rate
    ms: float

    def text(self) -> str:
        """The cell of a table."""
        wrong = f"wrong claims: {self.wrong.successes} of {self.wrong.total}"
        median_error = f"{metres(self.error_m)}, {milliseconds(self.ms)} ms"
        return f"{self.success.text()}\n{median_error}\n{wrong}"


@dataclass(frozen=True)
class Method:
    """A method at each of several levels.

    Attributes:
        title: Name of a preset of ours, or title of a baseline.
        maps: Number of aerial maps that it has had.
        achieved: What it achieved at each level; None where it was not tried.
    """

    title: str
    maps: int
    achieved: tuple[Achieved | None, ...]


def presets_at(levels: Sequence[AtLevel]) -> list[Method]:
    """Presets that were tried, after four aerial maps; the poses are from SLAM."""
    made = (
        Method(name, FOURTH_MAP, tuple(_of_preset(one, name) for one in levels)) for name in PRESETS
    )
    return [method for method in made if any(method.achieved)]


def baselines_at(levels: Sequence[AtLevel]) -> list[Method]:
    """Baselines that were tried, after one aerial map."""
    made = (
        Method(b.title, 1, tuple(_of_baseline(one, b.name) for one in levels)) for b in BASELINES
    )
    return [method for method in made if any(method.achieved)]


def level_table(levels: Sequence[AtLevel]) -> TextTable:
    """One row per method, one column per level; no rows for fewer than two levels."""
    if len(levels) < 2:
        return TextTable((), ())
    methods = [*presets_at(levels), *baselines_at(levels)]
    header = ("method", "aerial maps", *(str(one.level) for one in levels))
    rows = ((method.title, str(method.maps), *_cells(method.achieved)) for method in methods)
    return TextTable(header, tuple(rows))


@styled
def level_figures(levels: Sequence[AtLevel]) -> list[ReportFigure]:
    """Success of presets and of baselines, with intervals; none for fewer than two levels, or
    where baselines were tried at fewer."""
    if len(levels) < 2:
        return []
    tried = [one for one in levels if baselines_at([one])]
    return [_presets_figure(levels), *([_rivals_figure(tried)] if len(tried) > 1 else [])]


def _presets_figure(levels: Sequence[AtLevel]) -> ReportFigure:
    figure = Figure(figsize=(COLUMN_IN, 2.6), layout="constrained")
    axes = figure.subplots()
    presets = presets_at(levels)
    for index, (preset, colour) in enumerate(zip(presets, SERIES, strict=False)):
        shift = 0.08 * (index - (len(presets) - 1) / 2)
        places, shares, spans = _bars(preset.achieved)
        axes.errorbar(
            places + shift, shares, spans, color=colour, marker="o", capsize=2, label=preset.title
        )
    axes.set_xticks(range(len(levels)), [str(one.level) for one in levels])
    axes.set(ylim=(-3, 103), ylabel=f"{SUCCESS.title} [%]")
    axes.legend()
    caption = (
        f"Sequences {SUCCESS.title} at each level, poses from SLAM, with 95 % Wilson intervals; "
        "docs/levels.md says what makes each level."
    )
    return ReportFigure("levels", "Success against level", caption, figure, wide=False)


def _rivals_figure(levels: Sequence[AtLevel]) -> ReportFigure:
    rivals = baselines_at(levels)
    figure = Figure(
        figsize=(WIDE_IN, 0.8 + 0.07 * (1 + len(levels)) * len(rivals)), layout="constrained"
    )
    axes = figure.subplots()
    colours = colormaps["viridis"](np.linspace(0.85, 0.0, len(levels)))  # harder is darker
    for row, rival in enumerate(rivals):
        places, shares, spans = _bars(rival.achieved)
        for level, share, span in zip(places.astype(int), shares, spans.T, strict=True):
            at = row + (level - (len(levels) - 1) / 2) / (1 + len(levels))
            axes.errorbar(
                share, at, xerr=span[:, None], color=colours[level], marker="o", ms=3, capsize=1
            )
    for level, one in enumerate(levels):
        axes.errorbar([], [], color=colours[level], marker="o", label=str(one.level))
    axes.set_yticks(range(len(rivals)), [rival.title for rival in rivals])
    axes.invert_yaxis()
    axes.set(xlim=(-3, 103), xlabel=f"best guess within {LOCATED_M:g} m after one aerial map [%]")
    axes.grid(axis="x")
    figure.legend(loc="outside upper center", ncols=len(levels))
    caption = (
        "All methods after one aerial map at each level, with 95 % Wilson intervals. What each is "
        "given is in the table of baselines."
    )
    return ReportFigure("levels_rivals", "Rivals against level", caption, figure, wide=True)


def _bars(
    found: Sequence[Achieved | None],
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """(N,) levels where something was measured, (N,) success and (2, N) its bars [%]."""
    there = [(place, one.success) for place, one in enumerate(found) if one is not None]
    shares = np.array([100 * success.share for _, success in there])
    ends = np.array([[100 * success.low, 100 * success.high] for _, success in there]).T
    return np.array([float(place) for place, _ in there]), shares, np.abs(ends - shares)


def _cells(found: Sequence[Achieved | None]) -> list[str]:
    return [MISSING if one is None else one.text() for one in found]


def _of_preset(one: AtLevel, preset: str) -> Achieved | None:
    """What a preset achieved on its own SLAM: in the rows of its first condition."""
    for condition in one.table.conditions():
        if (condition.preset, condition.poses) == (preset, "slam"):
            table = one.table.of(condition).scored()
            claims = localization_claims(table).get(TO_BE_FOUND)
            wrong = wilson(0, 0) if claims is None else claims.wrong
            ms = sum(quantile(table.values("timing", stage), 0.5) for stage in PER_MAP)
            error_m = median(METRICS["localization_4"], table)
            return Achieved(rate(SUCCESS, table), rate(POSED, table), error_m, wrong, ms)
    return None


def _of_baseline(one: AtLevel, name: str) -> Achieved | None:
    """What a baseline achieved beside the first condition under which it was tried."""
    for condition in one.table.conditions():
        found = _achieved(one.table.of(condition).scored(), name)
        if found is not None:
            return found
    return None


def _achieved(table: ResultTable, name: str) -> Achieved | None:
    trials = baseline_trials(table, name)
    if trials.empty:
        return None
    near, claimed = trials["horizontal_m"] <= LOCATED_M, trials["claimed"] > 0
    posed = near & (trials["rotation_deg"] <= HEADING_DEG)
    return Achieved(
        wilson(int(near.sum()), len(trials)),
        wilson(int(posed.sum()), len(trials)),
        quantile(trials["horizontal_m"], 0.5),
        wilson(int((claimed & ~near).sum()), int(claimed.sum())),
        quantile(trials["ms"], 0.5),
    )

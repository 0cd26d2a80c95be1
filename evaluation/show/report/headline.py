"""The handful of numbers that a reader looks for first, each beside the paper's."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from evaluation.judge.summary import real_time_factor, within_5cm_2deg
from evaluation.show.report.tables import MISSING, degrees, metres, success_at
from evaluation.table.intervals import Rate, median_interval, quantile, wilson
from evaluation.table.rows import ResultTable


@dataclass(frozen=True)
class Headline:
    """One number.

    Attributes:
        title: What was measured.
        value: Here.
        detail: Of how many, and how sure.
        paper: The paper's value, in words.
    """

    title: str
    value: str
    detail: str
    paper: str


def headlines(table: ResultTable, seed: int) -> list[Headline]:
    """The numbers of one condition; what was not measured is left out.

    Args:
        table: Rows of one condition, control scenes apart.
        seed: Of the bootstrap.
    """
    rng = np.random.default_rng(seed)
    made = [
        _success(table, 4, 0.25, "paper: 89 % of 41 sequences"),
        _success(table, 1, 0.50, "paper: 65 % of 41 sequences"),
        _refined(table, "after_translation_m", "position after refinement", rng, "paper: 76 mm"),
        _refined(table, "after_rotation_deg", "angle after refinement", rng, "paper: 3.0°"),
        _good_refinements(table),
        _surface(table),
        _real_time(table),
    ]
    return [headline for headline in made if headline is not None]


def _success(table: ResultTable, iteration: int, limit: float, paper: str) -> Headline | None:
    made = success_at(table, iteration, limit)
    if made.total == 0:
        return None
    maps = "the first aerial map" if iteration == 1 else f"{iteration} aerial maps"
    title = f"localized within {limit:g} m after {maps}"
    return Headline(title, _share(made), _sure(made, "sequences"), paper)


def _refined(
    table: ResultTable, metric: str, title: str, rng: np.random.Generator, paper: str
) -> Headline | None:
    trials = table.trials()
    if metric not in trials:
        return None
    text = metres if metric.endswith("_m") else degrees
    made = median_interval(trials[metric], rng)
    detail = f"{len(trials)} trials; 95 %: {text(made.low)} to {text(made.high)}"
    return Headline(f"median {title}", text(made.value), detail, paper)


def _good_refinements(table: ResultTable) -> Headline | None:
    made = wilson(*within_5cm_2deg(table))
    if made.total == 0:
        return None
    title = "refined within 5 cm and 2°"
    return Headline(title, _share(made), _sure(made, "trials"), "paper: not given")


def _surface(table: ResultTable) -> Headline | None:
    medians = table.values("surface", "error_median_m")
    if len(medians) == 0:
        return None
    complete = 100 * quantile(table.values("surface", "completeness"), 0.5)
    return Headline(
        "median error of the fused surface",
        metres(quantile(medians, 0.5)),
        f"{len(medians)} surfaces; {complete:.0f} % of the pixels have depth",
        "paper: not given",
    )


def _real_time(table: ResultTable) -> Headline | None:
    factor = real_time_factor(table)
    if factor is None:
        return None
    oracle = any(condition.poses != "slam" for condition in table.conditions())
    return Headline(
        "recorded seconds a second of processing",
        f"{factor:.2f}",
        "both robots, no GPU; recordings measured at a time share the cores"
        + ("; poses from an oracle, so no SLAM" if oracle else ""),
        "paper: real time with a GPU",
    )


def _share(made: Rate) -> str:
    return f"{100 * made.share:.0f} %" if made.total else MISSING


def _sure(made: Rate, what: str) -> str:
    return (
        f"{made.successes} of {made.total} {what}; "
        f"95 %: {100 * made.low:.0f} to {100 * made.high:.0f}\u00a0%"
    )

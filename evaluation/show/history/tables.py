"""A history in words: its steps, the change since the first point, and the points."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from evaluation.judge.history.series import History, Series, Step
from evaluation.judge.metrics import Metric
from evaluation.setup.text import MISSING, TextTable
from evaluation.table.comparison import Effect

UNTESTED = "too few flights"
NONE = "none"
"""The change of a metric that is the same in every flight."""


def steps_table(found: History) -> TextTable:
    """Every step, newest first."""
    header = (
        "metric", "verdict", "at", "before", "after", "change", "95 % interval", "p", "tested",
    )  # fmt: skip
    return TextTable(header, tuple(_step_row(step, found) for step in found.steps()))


def totals_table(found: History) -> TextTable:
    """Every metric: first and last figure, and the change over the flights between them."""
    header = ("metric", "first", "last", "change", "95 % interval", "steps")
    rows = [_total_row(series) for series in found.series if series.total is not None]
    return TextTable(header, tuple(rows))


@dataclass(frozen=True)
class Revision:
    """A point in words."""

    name: str
    facts: str
    steps: str
    reason: str


def revisions(found: History) -> list[Revision]:
    """Every point, newest first."""
    made = []
    for place, point in reversed(list(enumerate(found.points))):
        flights = {flight for samples in point.samples.values() for flight in samples}
        values = f"{len(flights)} flights" if flights else "figures only"
        facts = f"accepted {point.day}, {values}" if point.day else values
        steps = [step for step in found.steps() if step.place == place]
        words = "; ".join(f"{step.verdict}: {step.metric.title}" for step in steps)
        made.append(Revision(point.revision, facts, words, point.reason))
    return made


def _step_row(step: Step, found: History) -> tuple[str, ...]:
    metric, point = step.metric, found.points[step.place]
    certain = bool(step.flights)
    how = "in pairs" if step.paired else "two samples"
    return (
        metric.title,
        str(step.verdict),
        f"{point.revision}\n{point.day or point.reason}",
        metric.fine_text(step.before),
        metric.fine_text(step.after),
        _change(metric, step.change.value),
        _interval(metric, step.change) if certain else MISSING,
        (f"{step.p:.3f}" if step.p >= 0.001 else "< 0.001") if certain else MISSING,
        f"{step.flights} flights, {how}" if certain else UNTESTED,
    )


def _total_row(series: Series) -> tuple[str, ...]:
    metric, total = series.metric, series.total
    assert total is not None
    measured = series.values[~np.isnan(series.values)]
    moved = total.value != 0 or total.low != 0 or total.high != 0
    return (
        metric.title,
        metric.fine_text(measured[0]),
        metric.fine_text(measured[-1]),
        _change(metric, total.value) if moved else NONE,
        _interval(metric, total) if moved else MISSING,
        str(len(series.steps)) if series.steps else MISSING,
    )


def _interval(metric: Metric, effect: Effect) -> str:
    if np.isinf(effect.low) and np.isinf(effect.high):
        return MISSING
    return f"{_change(metric, effect.low)} to {_change(metric, effect.high)}"


def _change(metric: Metric, value: float) -> str:
    if np.isinf(value):
        return "fails" if value > 0 else "no longer fails"
    return metric.fine_text(value, "+")

"""The verdict on each watched metric: better, worse, moved a little, or no difference seen.

Both sides must be of one suite. The same flights on both sides are paired, and so are their
trials one by one; entirely different flights are two samples. Better or worse needs two
things: the change is consistent beyond chance, after Holm's correction for all metrics
together, and it is at least as large as matters. A smaller change beyond chance is shown and
fails nothing. One observation shows nothing about chance: it gets no verdict.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from itertools import zip_longest

import numpy as np
from numpy.typing import NDArray

from airground.errors import InputError
from evaluation.judge.accepted import Measured, figure, flight_value
from evaluation.judge.metrics import WATCHED, Metric
from evaluation.judge.samples import Samples
from evaluation.setup.condition import Condition
from evaluation.table.comparison import (
    LEAST_OBSERVATIONS,
    Effect,
    adjusted,
    least_paired_p,
    least_two_sample_p,
    median,
    paired_effect,
    subtract,
    two_sample_effect,
)

ALPHA = 0.05
"""How often a check of an unchanged program may call any metric better or worse."""


class Verdict(StrEnum):
    BETTER = "better"
    WORSE = "worse"
    SLIGHTLY_BETTER = "slightly better"
    SLIGHTLY_WORSE = "slightly worse"
    SAME = "no difference seen"
    SINGLE = "one observation: no verdict possible"
    UNMEASURED = "not measured"


MOVED = (Verdict.WORSE, Verdict.BETTER, Verdict.SLIGHTLY_WORSE, Verdict.SLIGHTLY_BETTER)
"""Verdicts of a change beyond chance, in the order in which a reader wants to see them."""


@dataclass(frozen=True)
class Compared:
    """The change in one metric, before all are judged together.

    Attributes:
        effect: Size, interval and chance of the change.
        count: Number of observations; of two samples, the smaller.
        by_flight: Whether a flight is one observation; else each trial is, taken as independent.
    """

    effect: Effect
    count: int
    by_flight: bool


@dataclass(frozen=True)
class Judged:
    """One metric with its verdict.

    Attributes:
        before, after: Its figure on both sides; NaN where nothing was measured.
        compared: The change; None where nothing was measured.
        p: Probability of the change by chance, adjusted for all metrics; NaN where not measured.
        matters: The smallest effect that matters, in the metric's unit.
    """

    metric: Metric
    before: float
    after: float
    compared: Compared | None
    p: float
    matters: float
    verdict: Verdict


@dataclass(frozen=True)
class Comparison:
    """All metrics.

    Attributes:
        suite: The scenes, and number of flights over each.
        condition: Condition of `before`.
        paired: Whether both sides have the same flights.
        judged: In the order of `WATCHED`.
    """

    suite: str
    condition: Condition
    paired: bool
    judged: list[Judged]

    def of(self, verdict: Verdict) -> list[Judged]:
        return [one for one in self.judged if one.verdict == verdict]


def compare(before: Measured, after: Measured) -> Comparison:
    """Judge every watched metric.

    Raises:
        InputError: Suites differ, or only some flights are the same.
    """
    paired = _paired(before, after)
    compared = [
        _compared(metric, before.samples[metric.name], after.samples[metric.name], paired)
        for metric in WATCHED
    ]
    p_values = iter(adjusted([one.effect.p for one in compared if one is not None]))
    judged = []
    for metric, one in zip(WATCHED, compared, strict=True):
        old, new = (figure(metric, side.samples[metric.name]) for side in (before, after))
        matters = metric.matters
        if metric.relative:
            matters *= abs(old) if np.isfinite(old) else 0.0
        p = float("nan") if one is None else next(p_values)
        verdict = Verdict.UNMEASURED if one is None else _verdict(metric, one, p, matters)
        judged.append(Judged(metric, old, new, one, p, matters, verdict))
    return Comparison(before.suite, before.condition, paired, judged)


def _paired(before: Measured, after: Measured) -> bool:
    """Whether both have the same flights; raises where no comparison is possible."""
    if before.suite != after.suite:
        raise InputError(f"measured over {after.suite}; expected {before.suite}")
    shared = len(set(before.flights) & set(after.flights))
    if shared not in (0, len(before.flights)):
        raise InputError(
            f"{shared} of {len(before.flights)} flights are the same on both sides; expected "
            "all of them (the same seeds) or none (new seeds)"
        )
    return shared > 0


def _compared(metric: Metric, before: Samples, after: Samples, paired: bool) -> Compared | None:
    """The change in one metric; None where neither side measured anything."""
    if not any(before.values()) and not any(after.values()):
        return None
    if paired:
        differences, by_flight = paired_differences(metric, before, after)
        effect = paired_effect(differences, metric.share)
        return Compared(effect, len(differences), by_flight)
    by_flight = _reaches(least_two_sample_p(len(before), len(after)))
    old, new = (_observations(metric, side, by_flight) for side in (before, after))
    effect = two_sample_effect(old, new, metric.share)
    return Compared(effect, min(len(old), len(new)), by_flight)


def paired_differences(
    metric: Metric, before: Samples, after: Samples
) -> tuple[NDArray[np.float64], bool]:
    """(N,) after minus before, and whether each is one flight's; else each is one trial's.
    Trials are paired in their order; one that only one side has failed on the other. Some flight
    must have a value."""
    flights = []
    for flight in sorted(before.keys() | after.keys()):
        pairs = list(
            zip_longest(before.get(flight, []), after.get(flight, []), fillvalue=metric.failure)
        )
        if pairs:
            old, new = np.array(pairs).T
            flights.append(subtract(new, old))
    by_flight = _reaches(least_paired_p(len(flights)))
    if by_flight:
        middle = [float(d.mean()) if metric.share else median(d) for d in flights]
        return np.array(middle), True
    return np.concatenate(flights), False


def _observations(metric: Metric, samples: Samples, by_flight: bool) -> NDArray[np.float64]:
    if by_flight:
        return np.array([flight_value(metric, values) for values in samples.values()])
    # A flight without a value failed as a whole.
    return np.array([value for values in samples.values() for value in values or [metric.failure]])


def _reaches(least_p: float) -> bool:
    """Whether p can be small enough for a verdict, adjusted for all watched metrics."""
    return least_p * len(WATCHED) <= ALPHA


def _verdict(metric: Metric, compared: Compared, p: float, matters: float) -> Verdict:
    effect = compared.effect
    if compared.count < LEAST_OBSERVATIONS:
        return Verdict.SINGLE
    if p > ALPHA or effect.value == 0:
        return Verdict.SAME
    improved = (effect.value < 0) == (metric.better == "lower")
    if abs(effect.value) < matters:
        return Verdict.SLIGHTLY_BETTER if improved else Verdict.SLIGHTLY_WORSE
    return Verdict.BETTER if improved else Verdict.WORSE

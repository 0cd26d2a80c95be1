"""Every metric over the points of a history, with intervals, and the steps between its levels.

A step needs two things: the fit by constants of `evaluation.table.steps` changes its level
there, and the change over the flights is beyond chance. It is tested as `airground check` tests a
change, between windows of at most `WINDOW` points on both sides that do not reach beyond
neighbouring changes of level.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from airground.errors import InputError
from evaluation.judge.accepted import flight_value
from evaluation.judge.history.points import Point
from evaluation.judge.metrics import WATCHED, Metric
from evaluation.judge.samples import Flight
from evaluation.judge.verdict import ALPHA, Verdict
from evaluation.setup.condition import Condition
from evaluation.table.comparison import (
    Effect,
    adjusted,
    centre_interval,
    least_paired_p,
    least_two_sample_p,
    median,
    paired_effect,
    subtract,
    two_sample_effect,
)
from evaluation.table.steps import step_places

WINDOW = 5
"""Points on each side of a step that are compared: a median of five withstands two outliers."""


@dataclass(frozen=True)
class Step:
    """A change of a metric's level.

    Attributes:
        place: Index of the first point after it.
        before, after: Medians of the figures in the windows.
        change: Change over the flights; without test, only its value.
        flights: Number of flights that were tested; of two samples, the smaller; 0 without test.
        paired: Whether the same flights are on both sides.
        p: Probability by chance, adjusted for all metrics at this place; NaN without test.
        verdict: One of the verdicts of a change.
    """

    metric: Metric
    place: int
    before: float
    after: float
    change: Effect
    flights: int
    paired: bool
    p: float
    verdict: Verdict


@dataclass(frozen=True)
class Series:
    """One metric over N points.

    Attributes:
        values: (N,) figures; NaN where not measured, infinite for failures.
        low, high: (N,) 95 % intervals over flights; NaN where there is none.
        steps: Ascending in place.
        total: Change from the first point with values of flights to the last; None without two.
    """

    metric: Metric
    values: NDArray[np.float64]
    low: NDArray[np.float64]
    high: NDArray[np.float64]
    steps: list[Step]
    total: Effect | None


@dataclass(frozen=True)
class History:
    """All metrics over the points of one suite and condition, those of the last point.

    Attributes:
        left_out: Number of points by suite and condition that were left out.
    """

    points: list[Point]
    series: list[Series]
    suite: str
    condition: Condition | None
    left_out: dict[str, int]

    def steps(self) -> list[Step]:
        """All steps, newest first, then in the order of metrics."""
        every = [step for one in self.series for step in one.steps]
        return sorted(every, key=lambda step: -step.place)


def history(points: Sequence[Point]) -> History:
    """The series of all metrics, and their steps; InputError without points."""
    if not points:
        raise InputError("history: there is no result")
    known = [point for point in points if point.condition is not None]
    suite, condition = (known[-1].suite, known[-1].condition) if known else ("", None)
    kept, left_out = [], Counter[str]()
    for point in points:
        if point.condition is None or (point.suite, point.condition) == (suite, condition):
            kept.append(point)
        else:
            left_out[f"{point.suite}; {point.condition.label()}"] += 1
    steps = _steps(kept)
    made = [_series(metric, kept, steps[metric.name]) for metric in WATCHED]
    return History(kept, made, suite, condition, dict(left_out))


def figures(metric: Metric, points: Sequence[Point]) -> NDArray[np.float64]:
    """(N,) figures of a metric; NaN where not measured."""
    return np.array([point.figures.get(metric.name, np.nan) for point in points])


def matters(metric: Metric, reference: float) -> float:
    """The smallest change that matters, in the metric's unit."""
    if not metric.relative:
        return metric.matters
    return metric.matters * abs(reference) if np.isfinite(reference) else 0.0


def _series(metric: Metric, points: Sequence[Point], steps: list[Step]) -> Series:
    intervals = [centre_interval(_by_flight(metric, [p]), metric.share) for p in points]
    whole = [point for point in points if any(point.samples.get(metric.name, {}).values())]
    return Series(
        metric=metric,
        values=figures(metric, points),
        low=np.array([one.low for one in intervals]),
        high=np.array([one.high for one in intervals]),
        steps=steps,
        total=_tested(metric, whole[:1], whole[-1:])[0] if len(whole) > 1 else None,
    )


def _steps(points: Sequence[Point]) -> dict[str, list[Step]]:
    """The steps of every metric; p is adjusted for the metrics that step at one place."""
    candidates: dict[int, list[Step]] = defaultdict(list)
    for metric in WATCHED:
        for step in _candidates(metric, points):
            candidates[step.place].append(step)
    made: dict[str, list[Step]] = defaultdict(list)
    for place in sorted(candidates):
        found = candidates[place]
        raw = [step.change.p if step.flights else 1.0 for step in found]
        holm = adjusted([*raw, *[1.0] * (len(WATCHED) - len(raw))])
        for step, p in zip(found, holm, strict=False):
            judged = _judged(step, p)
            if judged is not None:
                made[step.metric.name].append(judged)
    return made


def _candidates(metric: Metric, points: Sequence[Point]) -> list[Step]:
    """A step at each change of level, tested and without a verdict."""
    values = figures(metric, points)
    middle = median(values[np.isfinite(values)])
    present = ~np.isnan(values)
    places = step_places(values, matters(metric, middle))
    made = []
    for start, place, end in zip([0, *places], places, [*places[1:], len(points)], strict=False):
        before = [n for n in range(start, place) if present[n]][-WINDOW:]
        after = [n for n in range(place, end) if present[n]][:WINDOW]
        old, new = median(values[before]), median(values[after])
        sides = [[points[n] for n in side] for side in (before, after)]
        change, flights, paired = _tested(metric, *sides)
        if not flights:
            value = float(subtract(np.array([new]), np.array([old]))[0])
            change = Effect(value, -np.inf, np.inf, 1.0)
        made.append(Step(metric, place, old, new, change, flights, paired, np.nan, Verdict.SAME))
    return made


def _judged(step: Step, p: float) -> Step | None:
    """The step with its verdict; None if it can be chance, or has no test and is too small."""
    size = abs(step.change.value)
    slight = size < matters(step.metric, step.before)
    if size == 0 or (p > ALPHA if step.flights else slight):
        return None
    improved = (step.change.value < 0) == (step.metric.better == "lower")
    if slight:
        verdict = Verdict.SLIGHTLY_BETTER if improved else Verdict.SLIGHTLY_WORSE
    else:
        verdict = Verdict.BETTER if improved else Verdict.WORSE
    tested = p if step.flights else float("nan")
    return Step(
        step.metric, step.place, step.before, step.after, step.change, step.flights, step.paired,
        tested, verdict,
    )  # fmt: skip


def _tested(
    metric: Metric, before: Sequence[Point], after: Sequence[Point]
) -> tuple[Effect, int, bool]:
    """Change between two windows, number of tested flights, and whether in pairs; 0 flights where
    too few are known for any significant result."""
    old, new = _medians(metric, before), _medians(metric, after)
    shared = sorted(old.keys() & new.keys())
    if shared:
        differences = subtract(
            np.array([new[flight] for flight in shared]),
            np.array([old[flight] for flight in shared]),
        )
        enough = least_paired_p(len(shared)) * len(WATCHED) <= ALPHA
        effect = paired_effect(differences, metric.share)
        return effect, len(shared) if enough else 0, True
    one, other = (np.array(list(side.values())) for side in (old, new))
    enough = bool(old and new) and (
        least_two_sample_p(len(one), len(other)) * len(WATCHED) <= ALPHA
    )
    effect = two_sample_effect(one, other, metric.share)
    return effect, min(len(one), len(other)) if enough else 0, False


def _medians(metric: Metric, points: Sequence[Point]) -> dict[Flight, float]:
    """Each flight's median over the points in which it was flown."""
    found: dict[Flight, list[float]] = defaultdict(list)
    for point in points:
        for flight, values in point.samples.get(metric.name, {}).items():
            found[flight].append(flight_value(metric, values))
    return {flight: median(np.array(values)) for flight, values in found.items()}


def _by_flight(metric: Metric, points: Sequence[Point]) -> NDArray[np.float64]:
    return np.array(list(_medians(metric, points).values()))

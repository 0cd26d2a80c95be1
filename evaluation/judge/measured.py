"""The watched metrics of one run, ready to be compared with those of another."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass

import numpy as np

from airground.errors import InputError
from evaluation.judge.metrics import WATCHED, Metric
from evaluation.judge.samples import Flight, Samples, flights
from evaluation.setup.condition import Condition
from evaluation.table.comparison import median
from evaluation.table.rows import ResultTable


@dataclass(frozen=True)
class Measured:
    """The watched metrics of one condition, over a suite: scenes, and number of flights over each.
    `flights` are sorted; `samples` are by the metric's name, then by flight."""

    suite: str
    condition: Condition
    flights: list[Flight]
    samples: dict[str, Samples]

    @classmethod
    def of(cls, table: ResultTable, condition: Condition | None = None) -> Measured:
        """The watched metrics under one condition, by default the table's first; raises InputError
        if nothing was measured under it."""
        if len(table) == 0:
            raise InputError("results: the table is empty")
        chosen = condition or table.conditions()[0]
        part = table.of(chosen)
        if len(part) == 0:
            known = "; ".join(other.label() for other in table.conditions())
            raise InputError(f"results: nothing was measured with {chosen.label()}; only: {known}")
        everyone = flights(part)
        samples = {metric.name: metric.samples(part) for metric in WATCHED}
        return cls(suite_of(everyone), chosen, everyone, samples)

    def only(self, kept: set[Flight]) -> Measured:
        """The same without the other flights."""
        remaining = [flight for flight in self.flights if flight in kept]
        samples = {
            name: {flight: values for flight, values in by_flight.items() if flight in kept}
            for name, by_flight in self.samples.items()
        }
        return Measured(suite_of(remaining), self.condition, remaining, samples)


def suite_of(everyone: list[Flight]) -> str:
    """The scenes and number of flights over each, as text."""
    counts = Counter(flight.scene for flight in everyone)
    return ", ".join(f"{scene} x {count}" for scene, count in sorted(counts.items()))


def figure(metric: Metric, samples: Samples) -> float:
    """The one number of a metric: the median of the flights' medians, or mean of their shares.
    NaN where nothing was measured."""
    per_flight = [flight_value(metric, values) for values in samples.values() if values]
    if not per_flight:
        return float("nan")
    return float(np.mean(per_flight)) if metric.share else median(np.array(per_flight))


def flight_value(metric: Metric, values: list[float]) -> float:
    """A flight as one observation; one without any value failed."""
    if not values:
        return metric.failure
    return float(np.mean(values)) if metric.share else median(np.array(values))


def headline(measured: Measured) -> dict[str, float]:
    return {metric.name: figure(metric, measured.samples[metric.name]) for metric in WATCHED}

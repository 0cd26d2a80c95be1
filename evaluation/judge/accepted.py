"""Figures of a run, and `accepted.json`: the figures that a change is compared with.

The file has every value under its flight, so that results of the same seeds can be paired with
them. JSON has no infinity: null is a failure.
"""

from __future__ import annotations

import json
import math
import re
from collections import Counter
from dataclasses import dataclass
from datetime import date
from pathlib import Path
from typing import Annotated, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from airground.errors import InputError
from evaluation.judge.metrics import WATCHED, Metric
from evaluation.judge.samples import DIGITS, Flight, Samples, flights
from evaluation.setup.checked_json import Part, read_checked
from evaluation.setup.condition import Condition
from evaluation.setup.output import write_whole
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


SCHEMA: Literal[1] = 1
Text = Annotated[str, Field(min_length=1)]


class Acceptance(Part):
    """One decision and its reason; `headline` has every metric's figure then, null for a
    failure."""

    date: date
    git_revision: str
    reason: Text
    headline: dict[str, float | None]


class ConditionPart(Part):
    preset: str
    poses: str
    sensors: str
    heading: str
    variant: str


class MetricPart(Part):
    """The values of one metric: one list per flight, in the order of `Accepted.flights`."""

    unit: str
    each: str
    values: list[list[float | None] | None]


class Accepted(Part):
    """Content of `accepted.json`; the newest acceptance is last in the history."""

    schema_: Literal[1] = Field(alias="schema")
    suite: str
    condition: ConditionPart
    history: Annotated[list[Acceptance], Field(min_length=1)]
    flights: Annotated[list[Flight], Field(min_length=1)]
    metrics: dict[str, MetricPart]

    @model_validator(mode="after")
    def _lists_are_whole(self) -> Self:
        for name, metric in self.metrics.items():
            if len(metric.values) != len(self.flights):
                raise ValueError(f"metrics.{name}: needs one list a flight ({len(self.flights)})")
        return self

    @classmethod
    def of(
        cls, measured: Measured, git_revision: str, reason: str, before: Accepted | None, on: date
    ) -> Accepted:
        """Accept figures and keep the history of `before`; raises InputError without a reason."""
        if not reason.strip():
            raise InputError("--reason: say why these figures are right; the file keeps it")
        decision = Acceptance(
            date=on,
            git_revision=git_revision,
            reason=reason.strip(),
            headline={name: _number(value) for name, value in headline(measured).items()},
        )
        return cls(
            schema=SCHEMA,
            suite=measured.suite,
            condition=ConditionPart(**vars(measured.condition)),
            history=[*(before.history if before else []), decision],
            flights=measured.flights,
            metrics={
                metric.name: MetricPart(
                    unit=metric.unit,
                    each=metric.each,
                    values=[
                        _numbers(measured.samples[metric.name].get(flight))
                        for flight in measured.flights
                    ],
                )
                for metric in WATCHED
            },
        )

    def measured(self) -> Measured:
        """The accepted figures as measured values; raises InputError if this version watches other
        metrics."""
        watched = [metric.name for metric in WATCHED]
        for name in [*watched, *self.metrics]:
            if name not in self.metrics or name not in watched:
                raise InputError(
                    f"metric {name!r} is not on both lists, that of the accepted figures and that "
                    "of this version; accept results of this version"
                )
        samples: dict[str, Samples] = {}
        for metric in WATCHED:
            lists = zip(self.flights, self.metrics[metric.name].values, strict=True)
            samples[metric.name] = {
                flight: [metric.failure if value is None else value for value in found]
                for flight, found in lists
                if found is not None
            }
        return Measured(self.suite, Condition(**vars(self.condition)), self.flights, samples)

    def write(self, path: Path) -> None:
        write_whole(path, compact_json(self))

    @classmethod
    def read(cls, path: Path) -> Accepted:
        """Read and check accepted figures; raises InputError if the file is missing, no JSON, or of
        another schema."""
        return read_checked(cls, path, "accepted figures")


def _numbers(values: list[float] | None) -> list[float | None] | None:
    return None if values is None else [_number(value) for value in values]


def _number(value: float) -> float | None:
    return float(f"{value:.{DIGITS}g}") if math.isfinite(value) else None


def compact_json(part: Part) -> str:
    """JSON with lists of plain values on one line each, so that a diff shows the changes."""
    made = part.model_dump(by_alias=True, mode="json")
    text = json.dumps(made, indent=1, allow_nan=False, ensure_ascii=False)
    # No string holds a raw line break.
    lists = re.compile(r"\[\n[^\[\]{}]*\]")
    return lists.sub(lambda found: " ".join(found.group().split()), text) + "\n"

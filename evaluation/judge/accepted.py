"""`accepted.json`: the figures that a change is compared with, and why they were accepted.

The file has every value under its flight, so that results of the same seeds can be paired with
them. JSON has no infinity: null is a failure.
"""

from __future__ import annotations

import json
import math
import re
from datetime import date
from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from airground.errors import InputError
from evaluation.judge.measured import Measured, headline
from evaluation.judge.metrics import WATCHED
from evaluation.judge.samples import DIGITS, Flight, Samples
from evaluation.setup.checked_json import Part, read_checked
from evaluation.setup.condition import Condition

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
        """Write one line per flight and metric, so that a diff shows the changes."""
        made = self.model_dump(by_alias=True, mode="json")
        lines = json.dumps(made, indent=1, allow_nan=False, ensure_ascii=False)
        partial = path.with_name(f".{path.name}.partial")
        try:
            partial.write_text(_compact(lines) + "\n", encoding="utf-8")
            partial.replace(path)
        finally:
            partial.unlink(missing_ok=True)

    @classmethod
    def read(cls, path: Path) -> Accepted:
        """Read and check accepted figures; raises InputError if the file is missing, no JSON, or of
        another schema."""
        return read_checked(cls, path, "accepted figures")


def _numbers(values: list[float] | None) -> list[float | None] | None:
    return None if values is None else [_number(value) for value in values]


def _number(value: float) -> float | None:
    return float(f"{value:.{DIGITS}g}") if math.isfinite(value) else None


def _compact(text: str) -> str:
    """Put lists of plain values on one line each; no string holds a raw line break."""
    return re.sub(r"\[\n[^\[\]{}]*\]", lambda found: " ".join(found.group().split()), text)

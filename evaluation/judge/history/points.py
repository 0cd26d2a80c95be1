"""The points of a history: one accepted or measured result each."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from datetime import date
from pathlib import Path

from pydantic import ValidationError

from airground.errors import InputError
from evaluation.judge.accepted import Acceptance, Accepted, Measured, figure
from evaluation.judge.metrics import WATCHED
from evaluation.judge.results import SUMMARY, TABLE, read_table
from evaluation.judge.samples import Samples
from evaluation.judge.summary import Summary
from evaluation.setup.condition import Condition
from evaluation.setup.git_versions import earlier_texts

ACCEPTED_FILES = "accepted*.json"
"""Files with accepted figures in a folder."""


@dataclass(frozen=True)
class Point:
    """One result.

    Attributes:
        revision: Revision of the code that measured it.
        reason: Reason of the acceptance, or name of the folder.
        day: Day of the acceptance; None for a folder.
        figures: Figure of each metric that was measured; infinite for a failure.
        samples: Values by metric and flight; empty where only figures are kept.
        suite: Scenes and number of flights; empty where only figures are kept.
        condition: Condition; None where only figures are kept.
    """

    revision: str
    reason: str
    day: date | None
    figures: dict[str, float]
    samples: dict[str, Samples]
    suite: str
    condition: Condition | None


def read_points(sources: Sequence[Path]) -> list[Point]:
    """The points of all sources, in the order given.

    Args:
        sources: Accepted figures with their earlier versions in git, folders of results, and
            folders that hold either; in a folder, results follow in natural order of names.

    Raises:
        InputError: A source cannot be read, or holds neither.
    """
    return [point for source in sources for point in _of_source(source)]


def _of_source(source: Path) -> list[Point]:
    if source.is_file():
        return accepted_points([*_parsed(earlier_texts(source)), Accepted.read(source)])
    if not source.is_dir():
        raise InputError(f"{source}: no such file or folder; expected accepted figures or results")
    if (source / SUMMARY).is_file():
        return [result_point(source)]
    files = sorted(source.glob(ACCEPTED_FILES), key=_natural)
    folders = sorted((found.parent for found in source.glob(f"*/{SUMMARY}")), key=_natural)
    if not files and not folders:
        raise InputError(
            f"{source}: has neither {ACCEPTED_FILES} nor folders with {SUMMARY}; expected "
            "accepted figures or results"
        )
    kept = accepted_points([Accepted.read(file) for file in files])
    return [*kept, *map(result_point, folders)]


def accepted_points(versions: Sequence[Accepted]) -> list[Point]:
    """One point per acceptance that any version lists, in the order of the lists.

    A version holds the values of its last acceptance; of an acceptance that is last in no
    version, only the figures are known.
    """
    whole = {_key(version.history[-1]): version for version in versions}
    listed: dict[tuple[date, str, str], Acceptance] = {}
    for version in sorted(versions, key=lambda version: len(version.history)):
        listed |= {_key(one): one for one in version.history if _key(one) not in listed}
    return [_acceptance_point(one, whole.get(key)) for key, one in listed.items()]


def result_point(folder: Path) -> Point:
    """The point of a folder that run or reproduce wrote; InputError where it is damaged."""
    summary = Summary.read(folder / SUMMARY)
    if not (folder / TABLE).is_file():
        raise InputError(f"{folder}: has no {TABLE}; figures and intervals are made from it")
    measured = Measured.of(read_table(folder))
    return Point(
        revision=summary.git_revision,
        reason=folder.resolve().name,
        day=None,
        figures=_figures(measured.samples),
        samples=measured.samples,
        suite=measured.suite,
        condition=measured.condition,
    )


def _acceptance_point(one: Acceptance, version: Accepted | None) -> Point:
    samples = _samples(version) if version else {}
    failures = {metric.name: metric.failure for metric in WATCHED}
    kept = {
        name: failures[name] if value is None else value
        for name, value in one.headline.items()
        if name in failures
    }
    return Point(
        revision=one.git_revision,
        reason=one.reason,
        day=one.date,
        figures=_figures(samples) if version else kept,
        samples=samples,
        suite=version.suite if version else "",
        condition=Condition(**vars(version.condition)) if version else None,
    )


def _samples(version: Accepted) -> dict[str, Samples]:
    """The values of the metrics that this version of the program defines alike."""
    made: dict[str, Samples] = {}
    for metric in WATCHED:
        kept = version.metrics.get(metric.name)
        if kept is not None and (kept.unit, kept.each) == (metric.unit, metric.each):
            made[metric.name] = {
                flight: [metric.failure if value is None else value for value in values]
                for flight, values in zip(version.flights, kept.values, strict=True)
                if values is not None
            }
    return made


def _figures(samples: dict[str, Samples]) -> dict[str, float]:
    return {
        metric.name: figure(metric, samples[metric.name])
        for metric in WATCHED
        if any(samples.get(metric.name, {}).values())
    }


def _key(one: Acceptance) -> tuple[date, str, str]:
    return one.date, one.git_revision, one.reason


def _parsed(texts: Iterable[str]) -> list[Accepted]:
    """The versions that this program can read; others had another schema."""
    made = []
    for text in texts:
        try:
            made.append(Accepted.model_validate_json(text))
        except ValidationError:
            continue
    return made


def _natural(path: Path) -> list[tuple[int, str]]:
    """Sorts run2 before run10."""
    parts = re.split(r"(\d+)", path.name)
    return [(int(part), "") if part.isdigit() else (-1, part) for part in parts]

"""A history for dashboards of others: github-action-benchmark, and the form of asv."""

from __future__ import annotations

import json
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np

from evaluation.judge.history.series import WINDOW, History, Series, Step
from evaluation.judge.verdict import ALPHA, Verdict
from evaluation.setup.checked_json import number

SMALLER, BIGGER, WHOLE = "smaller_is_better.json", "bigger_is_better.json", "history.json"
SCHEMA = 1
UNITS = {"": "share"}
"""Unit of a share, which others need a word for."""


def write_dashboards(out: Path, found: History) -> None:
    """Write the three files into an existing folder."""
    for name, better in ((SMALLER, "lower"), (BIGGER, "higher")):
        _write(out / name, last_point(found, better))
    _write(out / WHOLE, whole(found))


def last_point(found: History, better: str) -> list[dict[str, Any]]:
    """The last point's metrics of one direction, as github-action-benchmark reads them by its tools
    customSmallerIsBetter and customBiggerIsBetter. A failed metric has no number and is left
    out."""
    point = found.points[-1]
    entries = []
    for series in found.series:
        value, low, high = (float(side[-1]) for side in (series.values, series.low, series.high))
        if series.metric.better != better or not np.isfinite(value):
            continue
        entry = {
            "name": series.metric.title,
            "unit": _unit(series),
            "value": value,
            "extra": f"{series.metric.name}; {found.suite}; revision {point.revision}",
        }
        if np.isfinite(low) and np.isfinite(high):
            entry["range"] = f"{low:.5g} to {high:.5g}"
        entries.append(entry)
    return entries


def whole(found: History) -> dict[str, Any]:
    """The whole history by the names of asv's index, graphs and regressions, with intervals.
    Null is a failure, or what was not measured."""
    return {
        "schema": SCHEMA,
        "project": "airground",
        "suite": found.suite,
        "condition": vars(found.condition) if found.condition else None,
        "window": WINDOW,
        "alpha": ALPHA,
        "revision_to_hash": {str(n): point.revision for n, point in enumerate(found.points)},
        "revision_to_date": {
            str(n): int(1e3 * datetime(*point.day.timetuple()[:3], tzinfo=UTC).timestamp())
            for n, point in enumerate(found.points)
            if point.day is not None
        },
        "reasons": {str(n): point.reason for n, point in enumerate(found.points)},
        "benchmarks": {
            series.metric.name: {
                "pretty_name": series.metric.title,
                "unit": _unit(series),
                "better": series.metric.better,
            }
            for series in found.series
        },
        "graphs": {
            series.metric.name: [[n, number(value)] for n, value in enumerate(series.values)]
            for series in found.series
        },
        "intervals": {
            series.metric.name: [
                [n, number(low), number(high)]
                for n, (low, high) in enumerate(zip(series.low, series.high, strict=True))
            ]
            for series in found.series
        },
        "steps": [_step(step, found) for step in found.steps()],
        "regressions": [_regression(series) for series in found.series if _worse(series)],
    }


def _regression(series: Series) -> list[Any]:
    """Name, graph, parameters, index of the parameters, last and best value, and the jumps:
    revisions and values before and after."""
    metric = series.metric
    finite = series.values[np.isfinite(series.values)]
    best = (np.min if metric.better == "lower" else np.max)(finite) if len(finite) else np.nan
    jumps = [
        [step.place - 1, step.place, number(step.before), number(step.after)]
        for step in _worse(series)
    ]
    return [metric.name, metric.name, {}, None, number(series.values[-1]), number(best), jumps]


def _worse(series: Series) -> list[Step]:
    return [step for step in series.steps if step.verdict == Verdict.WORSE]


def _step(step: Step, found: History) -> dict[str, Any]:
    tested = bool(step.flights)
    return {
        "name": step.metric.name,
        "revision": step.place,
        "hash": found.points[step.place].revision,
        "verdict": str(step.verdict),
        "before": number(step.before),
        "after": number(step.after),
        "change": number(step.change.value),
        "low": number(step.change.low) if tested else None,
        "high": number(step.change.high) if tested else None,
        "p": number(step.p),
        "flights": step.flights,
        "paired": step.paired,
    }


def _unit(series: Series) -> str:
    return UNITS.get(series.metric.unit, series.metric.unit)


def _write(path: Path, content: object) -> None:
    text = json.dumps(content, indent=1, allow_nan=False, ensure_ascii=False)
    path.write_text(text + "\n", encoding="utf-8")

"""The reading of a metric from a table: a share or a median, with its 95 % interval.

Every number of the summary, the report and the sweeps is read here. Values are pooled over all
flights; verdicts, which take flights as observations, are `evaluation.judge.verdict`'s.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from evaluation.judge.metrics import Metric
from evaluation.judge.samples import Take
from evaluation.table.intervals import (
    Quantiles,
    Rate,
    median_interval,
    quantile,
    quantiles,
    wilson,
    with_failures,
)
from evaluation.table.rows import ResultTable

BOOTSTRAP_SEED = 0
"""The same table always gets the same intervals."""


@dataclass(frozen=True)
class Reading:
    """A share or a median with its 95 % interval, and the number of values it is made of."""

    value: float
    low: float
    high: float
    count: int


def rate_of(take: Take, table: ResultTable) -> Rate:
    """How many of the values, 0 or 1 each, are 1."""
    taken = take(table)
    return wilson(int((taken > 0).sum()), len(taken))


def rate(metric: Metric, table: ResultTable) -> Rate:
    """The share of a metric's values that are 1; of none where no sequence got that far."""
    return rate_of(metric.take, table) if _is_reached(metric, table) else wilson(0, 0)


def values(metric: Metric, table: ResultTable) -> NDArray[np.float64]:
    """(N,) a metric's values, failures as +inf; none where no sequence got that far."""
    return with_failures(metric.take(table) if _is_reached(metric, table) else [])


def median(metric: Metric, table: ResultTable) -> float:
    """The median of a metric's values; NaN of none."""
    return quantile(values(metric, table), 0.5)


def read(metric: Metric, table: ResultTable) -> Reading:
    """A metric's share or median with its interval."""
    if metric.share:
        found = rate(metric, table)
        return Reading(found.share, found.low, found.high, found.total)
    taken = values(metric, table)
    interval = median_interval(taken, np.random.default_rng(BOOTSTRAP_SEED))
    return Reading(interval.value, interval.low, interval.high, len(taken))


def spread(take: Take, table: ResultTable) -> Quantiles:
    """The quantiles of what is taken; infinite where failures reach, NaN of no values."""
    return quantiles(take(table))


def _is_reached(metric: Metric, table: ResultTable) -> bool:
    """Whether some sequence has the aerial map after which the metric is judged."""
    return metric.iteration is None or metric.iteration in table.sequences("error_m")


def real_time_factor(table: ResultTable) -> float:
    """Recorded seconds over processing seconds of all recordings; NaN where not measured."""
    processing = float(table.values("run", "processing_s").sum())
    recorded = float(table.values("run", "recorded_s").sum())
    return recorded / processing if processing > 0 else float("nan")

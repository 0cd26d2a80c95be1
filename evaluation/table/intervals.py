"""Statistics that keep failures: a missing or infinite error counts as infinitely large."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from evaluation.setup.text import MISSING, percent

NARROW = 0.01
"""Width of an interval of shares below which whole percents hide it."""


@dataclass(frozen=True)
class Interval:
    """A value and where it may lie with 95 % confidence."""

    value: float
    low: float
    high: float


@dataclass(frozen=True)
class Rate:
    """How many of how many succeeded, with a 95 % Wilson interval."""

    successes: int
    total: int
    low: float
    high: float

    @property
    def share(self) -> float:
        return self.successes / self.total if self.total else float("nan")

    def text(self) -> str:
        """The share; on a second line the counts and the interval."""
        if self.total == 0:
            return MISSING
        narrow = self.high - self.low < NARROW
        low, high = (f"{100 * end:.{2 if narrow else 0}f}" for end in (self.low, self.high))
        share = percent(self.share, 2 if narrow else 1)
        return f"{share}\n{self.successes} of {self.total}; {low} to {high} %"


@dataclass(frozen=True)
class Quantiles:
    """Median, quartiles and 95th percentile; infinite where failures reach that far."""

    median: float
    q25: float
    q75: float
    p95: float


def with_failures(values: ArrayLike) -> NDArray[np.float64]:
    """(N,) the values, with +inf for every NaN."""
    array = np.asarray(values, np.float64).ravel()
    return np.where(np.isnan(array), np.inf, array)


def quantile(values: ArrayLike, q: float) -> float:
    """Linearly interpolated quantile that may be infinite; NaN of no values. numpy interpolates inf
    - inf to NaN; here a quantile between a number and a failure is a failure."""
    ordered = np.sort(with_failures(values))
    if len(ordered) == 0:
        return float("nan")
    position = q * (len(ordered) - 1)
    below = int(np.floor(position))
    fraction = position - below
    if fraction < 1e-9:
        return float(ordered[below])
    low, high = ordered[below], ordered[below + 1]
    return float(low + fraction * (high - low)) if np.isfinite(high) else float("inf")


def quantiles(values: ArrayLike) -> Quantiles:
    """The quantiles that reports show."""
    return Quantiles(*(quantile(values, q) for q in (0.5, 0.25, 0.75, 0.95)))


def median_interval(values: ArrayLike, rng: np.random.Generator, resamples: int = 2000) -> Interval:
    """The median with a 95 % percentile bootstrap interval.
    Values are taken as independent; trials on the same recording are not quite."""
    array = with_failures(values)
    n = len(array)
    if n == 0:
        return Interval(float("nan"), float("nan"), float("nan"))
    samples = np.sort(array[rng.integers(0, n, (resamples, n))], axis=1)
    # Odd or even, the mean of the two middle values is the median.
    medians = 0.5 * (samples[:, (n - 1) // 2] + samples[:, n // 2])
    return Interval(quantile(array, 0.5), quantile(medians, 0.025), quantile(medians, 0.975))


def wilson(successes: int, total: int) -> Rate:
    """A success rate with its 95 % Wilson score interval (right also at 0 and 100 %)."""
    if not 0 <= successes <= total:
        raise ValueError(f"successes must lie in [0, {total}], got {successes}")
    if total == 0:
        return Rate(0, 0, 0.0, 1.0)
    p, z = successes / total, 1.959964
    centre = (p + z**2 / (2 * total)) / (1 + z**2 / total)
    half = z / (1 + z**2 / total) * np.sqrt(p * (1 - p) / total + z**2 / (4 * total**2))
    return Rate(successes, total, max(0.0, float(centre - half)), min(1.0, float(centre + half)))


def rate_within(values: ArrayLike, limit: float) -> Rate:
    """How many values stay within `limit`; failures do not."""
    array = with_failures(values)
    return wilson(int((array <= limit).sum()), len(array))

"""What changed between two sets of independent observations: size, interval, and chance.

One observation is one number of one flight (or of one trial, see `evaluation.judge.verdict`);
a failure may be infinite. Numbers are compared by ranks and their effect is a median, so
that one failure is one bad observation, however large; shares are compared by their mean.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import comb

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from evaluation.table.intervals import Interval

PERMUTATIONS = 10_000
"""Tests are exact up to this number of rearrangements; beyond it they draw as many."""
RESAMPLES = 2_000
SEED = 20_131_103
"""Seed of the rearrangements and the bootstrap: the same results give the same verdict."""
LEAST_OBSERVATIONS = 2
"""One observation shows nothing about chance."""


@dataclass(frozen=True)
class Effect:
    """What changed, in the metric's own unit.

    Attributes:
        value: After minus before; infinite where a typical observation became a failure.
        low, high: 95 % bootstrap interval of `value`, for this metric taken alone.
        p: How likely a change at least this consistent is by chance, in either direction.
    """

    value: float
    low: float
    high: float
    p: float


NO_EFFECT = Effect(0.0, 0.0, 0.0, 1.0)


def paired_effect(differences: NDArray[np.float64], share: bool) -> Effect:
    """The effect seen in N paired differences, after minus before.

    Tested by exchanging before and after at random in every pair: Wilcoxon's signed ranks
    (zeros ranked by Pratt's rule), or the differences themselves for shares. Fewer than
    `LEAST_OBSERVATIONS` differences have a value at most: no interval and p = 1.
    """
    if len(differences) < LEAST_OBSERVATIONS:
        return _untested(float(differences[0]) if len(differences) else 0.0)
    if not differences.any():
        return NO_EFFECT
    scores = differences if share else np.sign(differences) * stats.rankdata(np.abs(differences))
    tested = stats.permutation_test(
        (scores,),
        np.sum,
        permutation_type="samples",
        vectorized=True,
        n_resamples=PERMUTATIONS,
        rng=np.random.default_rng(SEED),
    )
    centre = _means if share else _medians
    draws = centre(_resampled(differences, np.random.default_rng(SEED)))
    return _effect(float(centre(differences[None])[0]), draws, len(differences), tested.pvalue)


def two_sample_effect(
    before: NDArray[np.float64], after: NDArray[np.float64], share: bool
) -> Effect:
    """The effect between two unpaired samples: difference of their medians, or means.

    Tested by exchanging observations between the samples: Mann and Whitney's rank sums, or
    the means for shares. Where a sample has fewer than `LEAST_OBSERVATIONS`, the effect has a
    value at most: no interval and p = 1.
    """
    centre = _means if share else _medians
    if len(before) == 0 or len(after) == 0:
        return _untested(0.0)
    value = float(subtract(centre(after[None]), centre(before[None]))[0])
    if min(len(before), len(after)) < LEAST_OBSERVATIONS:
        return _untested(value)
    pooled = np.concatenate([before, after])
    if (pooled == pooled[0]).all():
        return NO_EFFECT
    scores = pooled if share else stats.rankdata(pooled)
    tested = stats.permutation_test(
        (scores[: len(before)], scores[len(before) :]),
        _difference_of_means,
        permutation_type="independent",
        vectorized=True,
        n_resamples=PERMUTATIONS,
        rng=np.random.default_rng(SEED),
    )
    rng = np.random.default_rng(SEED)
    draws = subtract(centre(_resampled(after, rng)), centre(_resampled(before, rng)))
    return _effect(value, draws, min(len(before), len(after)), tested.pvalue)


def centre_interval(values: NDArray[np.float64], share: bool) -> Interval:
    """Median of N observations, for shares their mean, with its 95 % bootstrap interval; no
    interval for fewer than `LEAST_OBSERVATIONS`, all NaN for none."""
    if len(values) == 0:
        return Interval(np.nan, np.nan, np.nan)
    centre = _means if share else _medians
    value = float(centre(np.asarray(values, np.float64)[None])[0])
    if len(values) < LEAST_OBSERVATIONS:
        return Interval(value, np.nan, np.nan)
    draws = centre(_resampled(values, np.random.default_rng(SEED)))
    return Interval(value, *_expanded(draws, len(values)))


def subtract(after: NDArray[np.float64], before: NDArray[np.float64]) -> NDArray[np.float64]:
    """After minus before, where failing on both sides is no difference."""
    with np.errstate(invalid="ignore"):
        difference = np.asarray(after, np.float64) - np.asarray(before, np.float64)
    return np.where(np.isnan(difference), 0.0, difference)


def median(values: NDArray[np.float64]) -> float:
    """Median of values that may be infinite; NaN of none."""
    return float(_medians(np.asarray(values, np.float64)[None])[0]) if len(values) else float("nan")


def adjusted(p_values: Sequence[float]) -> list[float]:
    """Holm's step-down adjustment: below alpha, the family's error stays below alpha.
    Nothing is assumed of how the tests depend on each other."""
    order = np.argsort(p_values, kind="stable")
    made = np.empty(len(p_values))
    largest = 0.0
    for rank, index in enumerate(order):
        largest = max(largest, min(1.0, (len(p_values) - rank) * p_values[index]))
        made[index] = largest
    return made.tolist()


def least_paired_p(pairs: int) -> float:
    """The smallest p that a number of paired differences can reach."""
    return min(1.0, 2.0 ** (1 - pairs))


def least_two_sample_p(before: int, after: int) -> float:
    """The smallest p that samples of these sizes can reach."""
    return min(1.0, 2.0 / comb(before + after, before))


def _untested(value: float) -> Effect:
    return Effect(value, -np.inf, np.inf, 1.0)


def _difference_of_means(
    before: NDArray[np.float64], after: NDArray[np.float64], axis: int
) -> NDArray[np.float64]:
    return after.mean(axis=axis) - before.mean(axis=axis)


def _resampled(values: NDArray[np.float64], rng: np.random.Generator) -> NDArray[np.float64]:
    return values[rng.integers(0, len(values), (RESAMPLES, len(values)))]


def _means(samples: NDArray[np.float64]) -> NDArray[np.float64]:
    return samples.mean(axis=1)


def _medians(samples: NDArray[np.float64]) -> NDArray[np.float64]:
    """(R,) medians; between two opposite infinities lies 0."""
    ordered = np.sort(samples, axis=1)
    n = ordered.shape[1]
    low, high = ordered[:, (n - 1) // 2], ordered[:, n // 2]
    with np.errstate(invalid="ignore"):
        middle = 0.5 * (low + high)
    return np.where(np.isnan(middle), 0.0, middle)


def _effect(value: float, draws: NDArray[np.float64], n: int, p: float) -> Effect:
    return Effect(value, *_expanded(draws, n), float(p))


def _expanded(draws: NDArray[np.float64], n: int) -> tuple[float, float]:
    """The ends of the expanded percentile interval, which few observations need.
    Resampling N observations spreads sqrt((N - 1) / N) too little, and neglects that the spread is
    itself estimated (Hesterberg, The American Statistician 69(4), 2015)."""
    reach = stats.t.ppf(0.975, n - 1) * np.sqrt(n / (n - 1))
    tail = float(stats.norm.cdf(-reach))
    ordered = np.sort(draws)
    last = len(ordered) - 1
    return float(ordered[int(np.floor(tail * last))]), float(
        ordered[int(np.ceil((1 - tail) * last))]
    )

"""Where a series steps from one level to another: a fit by constants in the L1 norm.

The fit minimizes the sum of absolute deviations from the segments' medians plus a penalty per
step. A single outlier moves no median. The minimum is exact, by dynamic programming over the
last step, as in optimal partitioning (Jackson et al., IEEE Signal Processing Letters 12(2), 2005).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

NOISE_FACTOR = 3.0
"""Penalty of a step in standard deviations of the noise: a single value of normal noise lies
beyond it once in 370 values."""
QUARTILE_TO_SIGMA = 1 / (0.3186 * np.sqrt(2))
"""Standard deviation of normal noise over the lower quartile of the magnitudes of steps between
neighbours, whose variance is twice that of the noise."""


def noise(values: NDArray[np.float64]) -> float:
    """Standard deviation of a series about its level, from the lower quartile of the steps between
    neighbours: up to three of four may be changes of level. 0 for fewer than three values, where
    one step alone cannot be separated from noise."""
    steps = np.abs(np.diff(values[np.isfinite(values)]))
    if len(steps) < 2:
        return 0.0
    return float(QUARTILE_TO_SIGMA * np.quantile(steps, 0.25, method="lower"))


def step_places(values: NDArray[np.float64], matters: float) -> list[int]:
    """Places at which the level of a series changes.

    Args:
        values: (N,) the series; infinite values are failures, NaN are missing.
        matters: Smallest change of level that matters, in the unit of the values.

    Returns:
        Indices of the first value at each new level, ascending.
    """
    present = np.flatnonzero(~np.isnan(values))
    series = values[present]
    if len(series) < 2:
        return []
    penalty = max(matters, NOISE_FACTOR * noise(series), float(np.finfo(np.float64).tiny))
    return [int(present[start]) for start in _segments(_finite(series, penalty), penalty)[1:]]


def _finite(series: NDArray[np.float64], penalty: float) -> NDArray[np.float64]:
    """Failures as a level so far beyond all others that it is always a segment of its own."""
    finite = series[np.isfinite(series)]
    reach = (float(np.abs(finite).max()) if len(finite) else 0.0) + penalty
    far = 10.0 * len(series) * reach
    return np.nan_to_num(series, posinf=far, neginf=-far)


def _segments(series: NDArray[np.float64], penalty: float) -> list[int]:
    """Starts of the segments of the best fit; the first is 0."""
    count = len(series)
    deviations = _deviations(series)
    best = np.zeros(count + 1)
    last = np.zeros(count + 1, int)
    for end in range(1, count + 1):
        totals = best[:end] + penalty * (np.arange(end) > 0) + deviations[:end, end]
        last[end] = int(np.argmin(totals))
        best[end] = totals[last[end]]
    starts = [int(last[count])]
    while starts[-1] > 0:
        starts.append(int(last[starts[-1]]))
    return starts[::-1]


def _deviations(series: NDArray[np.float64]) -> NDArray[np.float64]:
    """(N, N + 1) sums of absolute deviations from the median of series[start:end]."""
    count = len(series)
    made = np.full((count, count + 1), np.inf)
    for length in range(1, count + 1):
        windows = np.lib.stride_tricks.sliding_window_view(series, length)
        middle = np.median(windows, axis=1, keepdims=True)
        starts = np.arange(len(windows))
        made[starts, starts + length] = np.abs(windows - middle).sum(axis=1)
    return made

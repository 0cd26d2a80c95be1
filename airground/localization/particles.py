"""The particle set's arithmetic: draw, weigh, resample, summarize (Eq. 4-6)."""

from __future__ import annotations

import numpy as np

from airground.core.arrays import F64, I64, Floats, Mask

MODE_RADIUS_M = 0.25


def likelihoods(costs: Floats, sigma: float) -> F64:
    """Eq. 5 relative to the lowest cost, so that nothing underflows; NaN stays NaN."""
    costs = np.asarray(costs, np.float64)
    if not np.isfinite(costs).any():
        return np.full(costs.shape, np.nan)
    return np.exp(-(costs - np.nanmin(costs)) / sigma)


def span(costs: Floats) -> float:
    """Highest minus lowest cost; 1 where that says nothing."""
    finite = costs[np.isfinite(costs)]
    return float(np.ptp(finite)) or 1.0 if len(finite) else 1.0


def weights(costs: Floats, sigma: float) -> F64:
    """(M,) normalized weights of particles by their costs.

    A particle outside the overlap rule (NaN) gets the median weight of the others: one map with too
    little overlap must not remove the right hypothesis. All are equal where no cost is known."""
    weight = likelihoods(costs, sigma)
    feasible = np.isfinite(weight)
    if not feasible.any():
        return np.full(len(weight), 1.0 / len(weight))
    weight[~feasible] = np.median(weight[feasible])
    result: F64 = weight / weight.sum()
    return result


def resample(weight: F64, rng: np.random.Generator) -> I64:
    """(M,) indices by low-variance systematic resampling of normalized weights (M,)."""
    m = len(weight)
    cumulative = np.cumsum(weight)
    pointers = (rng.random() + np.arange(m)) / m * cumulative[-1]
    result: I64 = np.minimum(np.searchsorted(cumulative, pointers, side="right"), m - 1)
    return result


def draw_cells(
    costs: Floats, sigma: float, count: int, rng: np.random.Generator
) -> tuple[I64, ...]:
    """Indices of `count` cells of a cost array, drawn by Eq. 5; some cost must be finite."""
    density = np.nan_to_num(likelihoods(costs, sigma), nan=0.0)
    cumulative = np.cumsum(density.ravel())
    chosen = np.searchsorted(cumulative, rng.random(count) * cumulative[-1], side="right")
    return np.unravel_index(np.minimum(chosen, density.size - 1), costs.shape)


def mean_pose(particles: F64) -> F64:
    """(3,) mean of x, y and circular mean of the heading of particles (M, 3)."""
    heading = np.angle(np.exp(1j * particles[:, 2]).mean())
    return np.array([*particles[:, :2].mean(axis=0), heading])


def densest_mode(particles: F64) -> Mask:
    """(M,) which particles lie around the one that has the most neighbours (in x, y)."""
    difference = particles[:, None, :2] - particles[None, :, :2]
    near = (difference**2).sum(axis=2) < MODE_RADIUS_M**2
    result: Mask = near[np.argmax(near.sum(axis=1))]
    return result

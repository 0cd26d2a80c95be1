"""Heights in channels, and how much of two height maps agrees, channel by channel.

A channel is a range of heights above the floor. A height belongs to the two nearest channels, by
weights that sum to 1, so that a small difference of heights costs a small part of the agreement.
Arrays of sums over an overlap end in an axis of `SUMS`: the number of cells that agree with each
shift of one floor against the other, and the weights of the channels of both maps there."""

from __future__ import annotations

import numpy as np
from numba import njit, prange

from airground.core.arrays import F32, F64, Floats

CHANNELS = 10
CHANNEL_M = 0.1
"""Distance of channels [m]: heights that differ by more agree nowhere. The lowest channel has the
floor and all below, the highest all from 0.9 m above it."""

SHIFTS = (0, -1, 1, -2, 2)
"""Channels by which an aerial map is lifted: where there is no level floor, most heights of one map
are not at the height of most of another."""

LEAST_SHARE = 1e-3
"""No share is surer than that: a single cell proves nothing."""

AERIAL = len(SHIFTS)
GROUND = AERIAL + CHANNELS
SUMS = GROUND + CHANNELS
"""Where in the sums the weights of the aerial and of the ground channels begin, and their end."""


@njit(cache=True, nogil=True, error_model="numpy")
def levels_above(heights: F32, floor: float) -> F32:
    """Heights (nx, ny) [m] above a floor, in channels, within the channels; NaN in holes."""
    levels = np.empty(heights.shape, np.float32)
    for i in range(heights.shape[0]):
        for j in range(heights.shape[1]):
            level = (heights[i, j] - np.float32(floor)) / np.float32(CHANNEL_M)
            highest = np.float32(CHANNELS - 1)
            levels[i, j] = min(max(level, np.float32(0)), highest) if level == level else np.nan
    return levels


@njit(cache=True, nogil=True, error_model="numpy")
def in_channels(levels: F32) -> F32:
    """(CHANNELS, nx, ny) weights of the channels of each cell; 0 in holes."""
    weights = np.zeros((CHANNELS, *levels.shape), np.float32)
    for i in range(levels.shape[0]):
        for j in range(levels.shape[1]):
            if levels[i, j] == levels[i, j]:
                lower = min(int(levels[i, j]), CHANNELS - 2)
                upper = levels[i, j] - np.float32(lower)
                weights[lower, i, j] = np.float32(1) - upper
                weights[lower + 1, i, j] = upper
    return weights


@njit(cache=True, parallel=True, nogil=True, error_model="numpy")
def channel_sums(places: F32, levels: F32, ground: F32, poses: F64) -> F64:
    """The sums (M, SUMS) for M poses of a turned aerial map; each aerial cell lies on the ground
    cell that its centre falls into.

    Args:
        places: (2, K) x and y of aerial cells from the camera [cells].
        levels: (K, S) their levels, lifted by each shift; the first one is 0.
        ground: (nx, ny) levels, NaN in holes.
        poses: (M, 3) position of the camera in `ground` [cells], and heading [rad].
    """
    sums = np.zeros((len(poses), SUMS))
    for p in prange(len(poses)):
        c, s = np.float32(np.cos(poses[p, 2])), np.float32(np.sin(poses[p, 2]))
        x0, y0 = np.float32(poses[p, 0] + 0.5), np.float32(poses[p, 1] + 0.5)
        for i in range(places.shape[1]):
            ix = int(np.floor(x0 + c * places[0, i] - s * places[1, i]))
            iy = int(np.floor(y0 + s * places[0, i] + c * places[1, i]))
            if not (0 <= ix < ground.shape[0] and 0 <= iy < ground.shape[1]):
                continue
            below = ground[ix, iy]
            if below == below:
                _add_weights(levels[i, 0], sums[p], AERIAL)
                _add_weights(below, sums[p], GROUND)
                for k in range(levels.shape[1]):
                    sums[p, k] += _agreement(levels[i, k], below)
    return sums


@njit(cache=True, inline="always")
def _add_weights(level: np.float32, sums: F64, first: int) -> None:
    """Add the weights of a level to those of the channels, of which the lowest is at `first`."""
    lower = min(int(level), CHANNELS - 2)
    upper = level - np.float32(lower)
    sums[first + lower] += np.float32(1) - upper
    sums[first + lower + 1] += upper


@njit(cache=True, inline="always")
def _agreement(a: np.float32, b: np.float32) -> np.float32:
    """Sum over the channels of the products of both levels' weights."""
    low, high = min(a, b), max(a, b)
    lower, upper = min(int(low), CHANNELS - 2), min(int(high), CHANNELS - 2)
    part, other = low - np.float32(lower), high - np.float32(upper)
    if lower == upper:
        return (np.float32(1) - part) * (np.float32(1) - other) + part * other
    if lower + 1 == upper:
        return part * (np.float32(1) - other)
    return np.float32(0)


@njit(cache=True, nogil=True, error_model="numpy")
def lifted_channel(channel: int, shift: int) -> int:
    """Channel of heights that are lifted by so many."""
    return min(max(channel + shift, 0), CHANNELS - 1)


@njit(cache=True, nogil=True, error_model="numpy")
def log_agreement_ratio(sums: Floats, min_count: float, cells_of_patch: float) -> F32:
    """ln p(heights are independent) - ln p(they agree) for sums (N, SUMS), with the likeliest shift
    [nat]; NaN where fewer than `min_count` cells overlap.

    Independent heights with the same channels agree with the probability c. Of n cells that agree
    with the share o, the ratio is n (o ln(o / c) + (1 - o) ln((1 - o) / (1 - c))). Cells of one
    patch count as one. No more than chance counts as chance."""
    costs = np.empty(len(sums), np.float32)
    for i in range(len(sums)):
        n = 0.0
        for channel in range(CHANNELS):
            n += sums[i, GROUND + channel]
        n = np.rint(n)
        if n < min_count or n < 1:
            costs[i] = np.nan
            continue
        best = 0.0
        for k in range(len(SHIFTS)):
            chance = 0.0
            for channel in range(CHANNELS):
                lifted = lifted_channel(channel, SHIFTS[k])
                chance += sums[i, AERIAL + channel] * sums[i, GROUND + lifted] / (n * n)
            best = max(best, _beyond_chance(sums[i, k] / n, chance))
        costs[i] = -n / cells_of_patch * best
    return costs


@njit(cache=True, inline="always")
def _beyond_chance(share: float, chance: float) -> float:
    """Logarithm of the likelihood ratio of one cell [nat]; 0 where the share is no larger."""
    o = min(max(share, LEAST_SHARE), 1 - LEAST_SHARE)
    c = min(max(chance, LEAST_SHARE), 1 - LEAST_SHARE)
    if o <= c:
        return 0.0
    return float(o * np.log(o / c) + (1 - o) * np.log((1 - o) / (1 - c)))

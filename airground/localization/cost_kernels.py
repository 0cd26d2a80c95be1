"""Sums over the cells where an aerial and a ground height map overlap, and costs from them.

Arrays of sums end in an axis of six: the number of cells, the sums of the aerial and of the
ground heights, of their squares, and of their products."""

from __future__ import annotations

import numpy as np
from numba import njit

from airground.core.arrays import C64, F32, F64, FAST, Floats

COUNT, SUM_A, SUM_G, SUM_AA, SUM_GG, SUM_AG = range(6)

VECTOR_CELLS = 32
"""Cells that a processor sums at a time. What is left of a row takes as long as a multiple of it.
So rows end in empty cells."""

MAX_CORRELATION = 0.999
"""No two robots' heights correlate more; the same heights have an infinite likelihood."""


@njit(cache=True, nogil=True, error_model="numpy", fastmath=FAST)
def mean_height(heights: F32) -> tuple[float, int]:
    """Mean (0 of none) and number of the heights that are not NaN."""
    total, count = 0.0, 0
    for i in range(len(heights)):
        row, filled = heights[i], np.int32(0)
        for j in range(len(row)):
            total += np.float64(row[j] if row[j] == row[j] else np.float32(0))
            filled += np.int32(row[j] == row[j])
        count += int(filled)
    return total / max(count, 1), count


@njit(cache=True, nogil=True, error_model="numpy")
def about_mean(heights: F32, margin: int, after: int) -> tuple[F32, F32, float]:
    """Heights (nx, ny) [m] with NaN in holes as heights about their mean, 0 in holes; mask; mean.
    The first two have an empty border, `margin` cells wide, and `after` more empty columns."""
    nx, ny = heights.shape
    mean, _ = mean_height(heights)
    centred = np.zeros((nx + 2 * margin, ny + 2 * margin + after), np.float32)
    mask = np.zeros((nx + 2 * margin, ny + 2 * margin + after), np.float32)
    middle, zero, one = np.float32(mean), np.float32(0), np.float32(1)
    for i in range(nx):
        row = heights[i]
        line = centred[i + margin, margin : margin + ny]
        filled = mask[i + margin, margin : margin + ny]
        for j in range(ny):
            inside = row[j] == row[j]
            line[j] = row[j] - middle if inside else zero
            filled[j] = one if inside else zero
    return centred, mask, mean


@njit(cache=True, nogil=True, error_model="numpy")
def zmssd(sums: Floats, min_count: float) -> F32:
    """Eq. 2 [m^2] for sums (N, 6); NaN where fewer than `min_count` cells overlap."""
    costs = np.empty(len(sums), np.float32)
    for i in range(len(sums)):
        n, sum_a, sum_g, sum_aa, sum_gg, sum_ag = sums[i]
        if n < min_count or n < 1:
            costs[i] = np.nan
            continue
        # sum((d - mean d)^2) = sum d^2 - (sum d)^2 / n with d = a - g.
        difference = sum_a - sum_g
        squares = sum_aa + sum_gg - 2 * sum_ag
        costs[i] = max(squares - difference * difference / n, 0.0) / (2 * n)
    return costs


@njit(cache=True, nogil=True, error_model="numpy")
def difference_spectrum(mask_a: C64, a: C64, mask_g: C64, g: C64, out: C64) -> None:
    """Spectrum of the sums of a - g, from those of masks and heights; written to `out`.
    In one pass over the rows: the memory's speed counts."""
    for i in range(len(out)):
        mi, ai, mg, gi, line = mask_a[i], a[i], mask_g[i], g[i], out[i]
        for j in range(len(line)):
            line[j] = ai[j] * mg[j] - mi[j] * gi[j]


@njit(cache=True, nogil=True, error_model="numpy")
def squares_spectrum(mask_a: C64, a: C64, aa: C64, mask_g: C64, g: C64, gg: C64, out: C64) -> None:
    """The same of the sums of (a - g)^2."""
    two = np.float32(2)
    for i in range(len(out)):
        mi, ai, aai, mg, gi, ggi, line = mask_a[i], a[i], aa[i], mask_g[i], g[i], gg[i], out[i]
        for j in range(len(line)):
            line[j] = aai[j] * mg[j] + mi[j] * ggi[j] - two * (ai[j] * gi[j])


@njit(cache=True, nogil=True, error_model="numpy")
def zmssd_of_differences(sums: F32, min_count: float) -> F32:
    """Eq. 2 [m^2] for the number of cells and the sums of height differences and of their squares
    (N, 3); NaN where fewer than `min_count` cells overlap."""
    costs = np.empty(len(sums), np.float32)
    for i in range(len(sums)):
        n, difference, squares = sums[i]
        if n < min_count or n < 1:
            costs[i] = np.nan
            continue
        costs[i] = max(squares - difference * difference / n, 0.0) / (2 * n)
    return costs


@njit(cache=True, nogil=True, error_model="numpy")
def one_minus_correlation(sums: Floats, min_count: float, min_relief_m: float) -> F32:
    """1 - normalized correlation for sums (N, 6); NaN where fewer than `min_count` overlap.
    Lower standard deviations are raised to `min_relief_m`: noise of flat ground fits nothing."""
    floor = min_relief_m * min_relief_m
    costs = np.empty(len(sums), np.float32)
    for i in range(len(sums)):
        n, sum_a, sum_g, sum_aa, sum_gg, sum_ag = sums[i]
        if n < min_count or n < 1:
            costs[i] = np.nan
            continue
        variance_a = max(sum_aa / n - (sum_a / n) ** 2, floor)
        variance_g = max(sum_gg / n - (sum_g / n) ** 2, floor)
        covariance = sum_ag / n - sum_a * sum_g / (n * n)
        costs[i] = 1.0 - covariance / np.sqrt(variance_a * variance_g)
    return costs


@njit(cache=True, nogil=True, error_model="numpy")
def log_likelihood_ratio(
    sums: Floats, min_count: float, min_relief_m: float, cells_of_patch: float
) -> F32:
    """ln p(independent) - ln p(correlated) of the heights for sums (N, 6) [nat]; NaN where fewer
    than `min_count` overlap.

    Of n independent pairs from a normal distribution, those with the correlation r are likelier by
    (1 - r^2)^(-n/2) than those without one. Cells of one patch count as one pair. So a good fit
    counts the more, the larger the overlap. Negative correlations count as none."""
    costs = one_minus_correlation(sums, min_count, min_relief_m)
    for i in range(len(sums)):
        correlation = min(max(1.0 - costs[i], 0.0), MAX_CORRELATION)
        pairs = sums[i, COUNT] / cells_of_patch
        if costs[i] == costs[i]:
            costs[i] = 0.5 * pairs * np.log(1.0 - correlation * correlation)
    return costs


@njit(cache=True, nogil=True, error_model="numpy", fastmath=FAST)
def sums_at_positions(
    aerial: F32, aerial_mask: F32, ground: F32, ground_mask: F32, shifts: F64
) -> F64:
    """The six sums (M, 6) for M fractional shifts of one map over another.

    Ground heights are interpolated bilinearly between the filled ones of four cells, if these carry
    at least half of the weight; a whole shift counts the same cells as the cost map.

    Args:
        aerial, ground: Heights [m] with 0 in holes. The last `VECTOR_CELLS` columns are empty.
        aerial_mask, ground_mask: 1 where filled, 0 in holes.
        shifts: (M, 2) index in `ground` of the aerial cell [0, 0] [cells].
    """
    sums = np.zeros((len(shifts), 6))
    for p in range(len(shifts)):
        shift_x, shift_y = np.floor(shifts[p, 0]), np.floor(shifts[p, 1])
        weight_x = np.float32(shifts[p, 0] - shift_x)
        weight_y = np.float32(shifts[p, 1] - shift_y)
        ix, iy = int(shift_x), int(shift_y)
        row_first = max(0, -ix)
        rows = min(aerial.shape[0], ground.shape[0] - 1 - ix) - row_first
        first = max(0, -iy)
        length = min(aerial.shape[1], ground.shape[1] - 1 - iy) - VECTOR_CELLS - first
        if rows <= 0 or length <= 0:
            continue
        length = -(-length // VECTOR_CELLS) * VECTOR_CELLS
        for row in range(rows):
            i, j = row_first + row, row_first + row + ix
            low, high = first + iy, first + iy + length + 1
            # One-dimensional slices: only these are known to be contiguous.
            _add_row(
                aerial[i, first : first + length],
                aerial_mask[i, first : first + length],
                ground[j, low:high],
                ground[j + 1, low:high],
                ground_mask[j, low:high],
                ground_mask[j + 1, low:high],
                weight_x,
                weight_y,
                sums[p],
            )
    return sums


# Inlined: called, it rounded otherwise once the caller came from the cache.
@njit(cache=True, inline="always", error_model="numpy", fastmath=FAST)
def _add_row(
    heights: F32,
    filled: F32,
    g0: F32,
    g1: F32,
    m0: F32,
    m1: F32,
    weight_x: np.float32,
    weight_y: np.float32,
    sums: F64,
) -> None:
    """Add one row of the overlap, between two rows of ground heights and of their mask."""
    zero, half = np.float32(0), np.float32(0.5)
    w00 = (np.float32(1) - weight_x) * (np.float32(1) - weight_y)
    w01 = (np.float32(1) - weight_x) * weight_y
    w10 = weight_x * (np.float32(1) - weight_y)
    w11 = weight_x * weight_y
    n, sum_a, sum_g, sum_aa, sum_gg, sum_ag = zero, zero, zero, zero, zero, zero
    for i in range(len(heights)):
        weight = w00 * m0[i] + w01 * m0[i + 1] + w10 * m1[i] + w11 * m1[i + 1]
        height = w00 * g0[i] + w01 * g0[i + 1] + w10 * g1[i] + w11 * g1[i + 1]
        valid = filled[i] if weight >= half else zero
        g = height / weight if weight >= half else zero
        a = heights[i]
        n += valid
        sum_a += valid * a
        sum_g += valid * g
        sum_aa += valid * a * a
        sum_gg += valid * g * g
        sum_ag += valid * a * g
    sums[0] += n
    sums[1] += sum_a
    sums[2] += sum_g
    sums[3] += sum_aa
    sums[4] += sum_gg
    sums[5] += sum_ag

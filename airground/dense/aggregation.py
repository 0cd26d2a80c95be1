"""From summed photometric errors to a mean cost per pixel and plane (Sec. V).

The sum over a window is divided by the number of its samples that lie within a view.

Beside an edge, half of the views see something else. The views before the reference or those
after it count alone where their mean is lower than that of all by more than a penalty; without
the penalty the lower of two noisy costs would win everywhere."""

from __future__ import annotations

import numpy as np
from numba import njit, prange

from airground.core.arrays import FAST, I16, I32, U16
from airground.dense.plane_sweep import CostVolume, Workspace
from airground.dense.sweep_kernels import COST_SCALE

MEAN_SCALE = 128.0
"""Mean costs are stored in 1/128 of a grey level."""
ROWS_A_TASK = 12


def aggregate(
    volumes: list[CostVolume],
    window_px: int,
    truncation: float,
    one_side_penalty: float,
    workspace: Workspace,
) -> U16:
    """Mean cost over a square window and over the views.

    Args:
        volumes: Cost volumes of one or both sides of a sweep.
        window_px: Side of the window, odd.
        truncation: Largest cost of a sample, and cost where no view covers [grey levels].
        one_side_penalty: Extra cost of the mean over one side alone [grey levels].
        workspace: Memory of the result.

    Returns:
        (height, width, planes) uint16 in 1/128 of a grey level.
    """
    if window_px % 2 == 0:
        raise ValueError(f"window_px must be odd, got {window_px}")
    volumes = [volume for volume in volumes if volume.limits]
    if not volumes:
        raise ValueError("no view was added to the sweep")
    height, planes, width = volumes[0].costs.shape
    mean = workspace.take((height, width, planes))
    first, last = volumes[0], volumes[-1]
    box_mean(
        first.costs,
        np.stack(first.limits),
        last.costs,
        np.stack(last.limits),
        len(volumes) > 1,
        window_px // 2,
        MEAN_SCALE * truncation,
        MEAN_SCALE * one_side_penalty,
        mean,
    )
    return mean


@njit(cache=True, error_model="numpy", fastmath=FAST)
def _slide_down(
    costs: U16, limits: I16, enters: int, leaves: int, sums: I32, counts: I32, margin: int
) -> None:
    """Image row `enters` joins the running window sums, and row `leaves` goes; -1 is no row."""
    _, planes, width = costs.shape
    views = np.int32(len(limits))
    for p in range(planes):
        total, count = sums[p, margin : margin + width], counts[p, margin : margin + width]
        if enters >= 0 and leaves >= 0:
            new, old = costs[enters, p], costs[leaves, p]
            for x in range(width):
                total[x] += np.int32(new[x]) - np.int32(old[x])
        elif enters >= 0:
            new = costs[enters, p]
            for x in range(width):
                total[x] += np.int32(new[x])
        elif leaves >= 0:
            old = costs[leaves, p]
            for x in range(width):
                total[x] -= np.int32(old[x])
        # Where one row enters and one leaves, what all views cover stays counted.
        if enters >= 0 and leaves < 0:
            count += views
        elif leaves >= 0 and enters < 0:
            count -= views
        if enters >= 0:
            _count_uncovered(limits[:, enters, p], count, -1)
        if leaves >= 0:
            _count_uncovered(limits[:, leaves, p], count, 1)


@njit(cache=True, error_model="numpy")
def _count_uncovered(limits: I16, count: I32, sign: int) -> None:
    """Add to `count` (sign 1), or take away (-1), how many views miss each pixel of a row."""
    signed = np.int32(sign)
    # Most views cover most of a row.
    for v in range(len(limits)):
        before, after = count[: limits[v, 0]], count[limits[v, 1] :]
        for x in range(len(before)):
            before[x] += signed
        for x in range(len(after)):
            after[x] += signed


@njit(cache=True, error_model="numpy", fastmath=FAST)
def _window_sum(source: I32, out: I32, radius: int) -> None:
    """out[x] = sum of source[x : x + 2 radius + 1]."""
    width = len(out)
    middle = source[radius : radius + width]
    if radius == 0:
        out[:] = middle
        return
    left, right = source[radius - 1 :], source[radius + 1 :]
    for x in range(width):
        out[x] = left[x] + middle[x] + right[x]
    # Two columns at a time, so that the sums so far are read and written half as often.
    for i in range(2, radius + 1):
        left, right = source[radius - i :], source[radius + i :]
        for x in range(width):
            out[x] += left[x] + right[x]


@njit(cache=True, parallel=True, nogil=True, error_model="numpy", fastmath=FAST)
def box_mean(
    first: U16,
    first_limits: I16,
    last: U16,
    last_limits: I16,
    both: bool,
    radius: int,
    uncovered: float,
    penalty: float,
    mean: U16,
) -> None:
    """Fills `mean`; see `aggregate`.

    Args:
        first, last: (height, planes, width) uint16 summed costs; `last` counts if `both`.
        first_limits, last_limits: (views, height, planes, 2) int16 covered columns [lo, hi).
        both: Whether there are two volumes.
        radius: The window is 2 radius + 1 wide and high.
        uncovered: Stored mean where no view covers the window.
        penalty: Stored mean that one side alone costs more.
        mean: (height, width, planes) uint16 mean costs, filled.
    """
    height, planes, width = first.shape
    factor = np.float32(MEAN_SCALE / COST_SCALE)
    ceiling, alone = np.float32(uncovered), np.float32(penalty)
    padded = width + 2 * radius
    for task in prange((height + ROWS_A_TASK - 1) // ROWS_A_TASK):
        begin = task * ROWS_A_TASK
        end = min(begin + ROWS_A_TASK, height)
        sums = np.zeros((2, planes, padded), np.int32)
        counts = np.zeros((2, planes, padded), np.int32)
        total, count = np.empty((2, width), np.int32), np.empty((2, width), np.int32)
        block = np.empty((planes, width), np.uint16)
        for y in range(begin - 2 * radius, end):
            # The window ends `radius` rows further down; that of the row before began `radius`
            # rows further up. The first of them starts with nothing in it.
            enters = y + radius if 0 <= y + radius < height else -1
            leaves = y - radius - 1 if y > begin and y - radius - 1 >= 0 else -1
            _slide_down(first, first_limits, enters, leaves, sums[0], counts[0], radius)
            if both:
                _slide_down(last, last_limits, enters, leaves, sums[1], counts[1], radius)
            if y < begin:
                continue
            for p in range(planes):
                _window_sum(sums[0, p], total[0], radius)
                _window_sum(counts[0, p], count[0], radius)
                if both:
                    _window_sum(sums[1, p], total[1], radius)
                    _window_sum(counts[1, p], count[1], radius)
                    _mean_of_sides(total, count, factor, ceiling, alone, block[p])
                else:
                    _mean(total[0], count[0], factor, ceiling, block[p])
            _transpose(block, mean[y])


@njit(cache=True, error_model="numpy", fastmath=FAST)
def _mean(total: I32, count: I32, factor: np.float32, ceiling: np.float32, out: U16) -> None:
    """Sum over number of samples, as stored."""
    for x in range(len(out)):
        value = factor * np.float32(total[x]) / np.float32(max(count[x], np.int32(1)))
        out[x] = np.uint16(np.int32(value if count[x] > 0 else ceiling))


@njit(cache=True, error_model="numpy", fastmath=FAST)
def _mean_of_sides(
    total: I32, count: I32, factor: np.float32, ceiling: np.float32, alone: np.float32, out: U16
) -> None:
    """The mean over both sides, or over the better one plus a penalty, whichever is lower."""
    one = np.int32(1)
    total0, total1, count0, count1 = total[0], total[1], count[0], count[1]
    for x in range(len(out)):
        n0, n1 = count0[x], count1[x]
        sum0, sum1 = factor * np.float32(total0[x]), factor * np.float32(total1[x])
        mean0 = sum0 / np.float32(max(n0, one)) if n0 > 0 else ceiling
        mean1 = sum1 / np.float32(max(n1, one)) if n1 > 0 else ceiling
        n = np.float32(n0) + np.float32(n1)
        value = (sum0 + sum1) / max(n, np.float32(1)) if n > 0 else ceiling
        out[x] = np.uint16(np.int32(min(value, min(mean0, mean1) + alone)))


@njit(cache=True, error_model="numpy")
def _transpose(block: U16, out: U16) -> None:
    """out = block.T in tiles that fit the cache's lines."""
    planes, width = block.shape
    for x0 in range(0, width, 32):
        x1 = min(x0 + 32, width)
        for p0 in range(0, planes, 32):
            p1 = min(p0 + 32, planes)
            for x in range(x0, x1):
                line = out[x, p0:p1]
                for p in range(p1 - p0):
                    line[p] = block[p0 + p, x]

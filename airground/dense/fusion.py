"""TV-L1 fusion of the distance fields (Sec. V, Eq. 1).

    min over phi of  sum over v of  |grad phi| + lambda sum_j n(v, j) |phi(v) - c_j|

by the first-order primal-dual method of Chambolle and Pock (2011), on the voxel grid with
forward differences and a step of one voxel in each direction."""

from __future__ import annotations

import numpy as np
from numba import njit, prange

from airground.core.arrays import F32, FAST, U32
from airground.dense.distance_field import MAX_BINS

STEP = 12.0**-0.5
"""Primal and dual step; the squared norm of the 3-d gradient is at most 12."""
BLOCK_ROWS = 16
"""Rows that one thread takes at a time; fixed, so that the number of threads changes nothing."""
AT_ONCE = 2
"""Iterations in one pass through memory; at most half of `BLOCK_ROWS`."""
UNSEEN = -1.0
"""Where no depth map sees anything, phi starts behind the surface."""


class Fusion:
    """Minimizes Eq. 1; keeps its working memory from one surface to the next."""

    def __init__(self, data_weight: float, iterations: int, bins: int = MAX_BINS) -> None:
        self.data_weight = data_weight
        self.iterations = iterations
        self.spacing = 2.0 / bins
        self._memory: F32 | None = None

    def reserve(self, shape: tuple[int, int, int]) -> None:
        """Take the working memory for a volume of this shape from the system, zeroed: a write to
        each page, which the first surface would wait for."""
        self._memory = np.empty((5, *shape), np.float32)
        self._memory.fill(0.0)

    def fuse(self, counts: U32) -> F32:
        """The field phi (rows, planes, columns) for the packed histogram n(v, j) of that shape.
        It is valid until the next call."""
        if self._memory is None or self._memory.shape[1:] != counts.shape:
            self._memory = np.empty((5, *counts.shape), np.float32)
        phi, ahead, dy, dk, dx = self._memory
        start(counts, self.spacing, phi)
        for done in range(0, self.iterations, AT_ONCE):
            iterate(
                min(AT_ONCE, self.iterations - done), done == 0,
                counts, self.spacing, phi, ahead, dy, dk, dx, STEP, STEP * self.data_weight,
            )  # fmt: skip
        result: F32 = phi
        return result


@njit(cache=True, parallel=True, nogil=True, error_model="numpy", fastmath=FAST)
def start(counts: U32, spacing: float, phi: F32) -> None:
    """phi at the mean of its histogram."""
    rows, planes, columns = counts.shape
    width = np.float32(spacing)
    for y in prange(rows):
        for k in range(planes):
            word, out = counts[y, k], phi[y, k]
            for x in range(columns):
                votes, total = np.uint32(0), np.uint32(0)
                for j in range(8):
                    n = (word[x] >> np.uint32(4 * j)) & np.uint32(15)
                    votes += n
                    total += n * np.uint32(j)
                many = np.float32(max(votes, np.uint32(1)))
                mean = (np.float32(total) / many + np.float32(0.5)) * width
                out[x] = mean - np.float32(1) if votes > 0 else np.float32(UNSEEN)


@njit(cache=True, parallel=True, nogil=True, error_model="numpy", fastmath=FAST)
def iterate(
    times: int,
    from_start: bool,
    counts: U32,
    spacing: float,
    phi: F32,
    ahead: F32,
    dy: F32,
    dk: F32,
    dx: F32,
    step: float,
    weight: float,
) -> None:
    """Some steps of dual and primal, in one pass through memory.

    A row's dual step needs the row behind it, not yet changed; its primal step needs the dual of
    the row before it. So a row can take its next step as soon as the row behind it has taken
    the one before, while both are still in the cache. A block of rows is on its own once the dual
    of its last row is there, for the block behind needs that; but with each further step it
    lacks one more row at either end. These seams are made up for when all blocks are done.

    With `from_start`, the dual counts as zero and the extrapolation as phi:
    filling them first would cost two passes through memory."""
    rows = len(phi)
    blocks = max(rows // BLOCK_ROWS, 1)
    fields = counts, phi, ahead, dy, dk, dx
    sizes = np.float32(step), np.float32(weight), np.float32(spacing)
    for seam in prange(blocks - 1):
        step_row((np.int64(seam) + 1) * BLOCK_ROWS - 1, True, from_start, False, fields, sizes)
    for block in prange(blocks):
        first = np.int64(block) * BLOCK_ROWS
        at_start, at_end = block == 0, block == blocks - 1
        last = rows - 1 if at_end else first + BLOCK_ROWS - 1
        for front in range(first, last + times):
            for before in range(times):  # steps that the row has taken already
                row = front - before
                start = first if at_start else first + before
                end = last if at_end else last - before
                # The dual of a block's last row was there from the start, for its first step.
                has_dual = before == 0 and row == last and not at_end
                one_more = not at_start and before > 0 and row == start - 1
                primal = start <= row <= end
                if primal or one_more:
                    fresh = from_start and before == 0
                    step_row(row, not has_dual, fresh, primal, fields, sizes)
    for seam in prange(blocks - 1):
        last = (np.int64(seam) + 1) * BLOCK_ROWS - 1
        for before in range(1, times):
            for row in range(last - before + 1, last + before + 1):
                step_row(row, row < last + before, False, True, fields, sizes)


@njit(cache=True, nogil=True, error_model="numpy", fastmath=FAST)
def step_row(row, dual, fresh, primal, fields, sizes):  # type: ignore[no-untyped-def]
    """A step of a row's dual (`fresh`: its first of all), of its primal, or of both."""
    counts, phi, ahead, dy, dk, dx = fields
    leading = phi if fresh else ahead
    step, weight, spacing = sizes
    rows, planes, columns = phi.shape
    moved, zero = np.empty(columns, np.float32), np.zeros(columns, np.float32)
    below = min(row + 1, rows - 1)
    for k in range(planes):
        a, b, c = dy[row, k], dk[row, k], dx[row, k]
        if dual:
            here, down = leading[row, k], leading[below, k]
            deep = leading[row, min(k + 1, planes - 1)]
            if fresh:
                a[:], b[:], c[:] = zero, zero, zero
            dual_step(here, down, deep, a, b, c, step)
        if primal:
            a_before = dy[row - 1, k] if row > 0 else zero
            b_before = dk[row, k - 1] if k > 0 else zero
            descend(phi[row, k], a, b, c, a_before, b_before, step, moved)
            primal_step(moved, counts[row, k], phi[row, k], ahead[row, k], weight, spacing)


@njit(cache=True, nogil=True, error_model="numpy", fastmath=FAST)
def dual_step(here: F32, down: F32, deep: F32, a: F32, b: F32, c: F32, sigma: np.float32) -> None:
    """p <- project(p + sigma grad phi_ahead) onto the unit ball, along a line."""
    one = np.float32(1)
    last = len(here) - 1
    right = here[1:]
    for x in range(last):
        u = a[x] + sigma * (down[x] - here[x])
        v = b[x] + sigma * (deep[x] - here[x])
        w = c[x] + sigma * (right[x] - here[x])
        shrink = one / max(one, np.sqrt(u * u + v * v + w * w))
        a[x] = u * shrink
        b[x] = v * shrink
        c[x] = w * shrink
    u = a[last] + sigma * (down[last] - here[last])
    v = b[last] + sigma * (deep[last] - here[last])
    shrink = one / max(one, np.sqrt(u * u + v * v))
    a[last] = u * shrink
    b[last] = v * shrink


@njit(cache=True, nogil=True, error_model="numpy", fastmath=FAST)
def descend(
    phi: F32, a: F32, b: F32, c: F32, a_before: F32, b_before: F32, tau: np.float32, moved: F32
) -> None:
    """phi + tau div p along a line, written to `moved`."""
    moved[0] = phi[0] + tau * (a[0] - a_before[0] + b[0] - b_before[0] + c[0])
    for x in range(1, len(phi)):
        moved[x] = phi[x] + tau * (a[x] - a_before[x] + b[x] - b_before[x] + c[x] - c[x - 1])


@njit(cache=True, nogil=True, error_model="numpy", fastmath=FAST)
def primal_step(
    moved: F32, word: U32, phi: F32, ahead: F32, data_weight: np.float32, width: np.float32
) -> None:
    """phi <- prox(moved) along a line, and the extrapolation 2 phi_new - phi_old.

    The prox of tau lambda sum_j n_j |phi - c_j| at v is
    max over k = 0..8 of min(v + tau lambda W_k, c_{k+1}) with W_0 = N, W_k = W_{k-1} - 2 n_k
    and c_9 = inf: the k-th term is the solution if it lies between c_k and c_{k+1}. With
    fewer than eight bins the rest stay empty and add no kink."""
    for x in range(len(phi)):
        value = prox(moved[x], np.uint32(word[x]), data_weight, width)
        ahead[x] = value + value - phi[x]
        phi[x] = value


@njit(cache=True, inline="always")
def _count(word: np.uint32, bits: int) -> np.float32:
    """One of the eight counts as float32: mixed with integers, they would widen to 64 bits."""
    return np.float32(np.int32(np.uint32(np.uint32(word) >> np.uint32(bits)) & np.uint32(15)))


@njit(cache=True, inline="always", error_model="numpy", fastmath=FAST)
def prox(v: np.float32, word: np.uint32, weight: np.float32, spacing: np.float32) -> np.float32:
    """argmin over u of (u - v)^2 / 2 + weight sum_j n_j |u - c_j|, for packed counts.
    The centres are c_j = spacing (j + 1/2) - 1, j = 0..7."""
    n0, n1, n2, n3 = _count(word, 0), _count(word, 4), _count(word, 8), _count(word, 12)
    n4, n5, n6, n7 = _count(word, 16), _count(word, 20), _count(word, 24), _count(word, 28)
    w = weight * (n0 + n1 + n2 + n3 + n4 + n5 + n6 + n7)
    two = weight + weight
    centre = np.float32(0.5) * spacing - np.float32(1)
    u = min(v + w, centre)
    w -= two * n0
    centre += spacing
    u = max(u, min(v + w, centre))
    w -= two * n1
    centre += spacing
    u = max(u, min(v + w, centre))
    w -= two * n2
    centre += spacing
    u = max(u, min(v + w, centre))
    w -= two * n3
    centre += spacing
    u = max(u, min(v + w, centre))
    w -= two * n4
    centre += spacing
    u = max(u, min(v + w, centre))
    w -= two * n5
    centre += spacing
    u = max(u, min(v + w, centre))
    w -= two * n6
    centre += spacing
    u = max(u, min(v + w, centre))
    w -= two * n7
    return max(u, v + w)

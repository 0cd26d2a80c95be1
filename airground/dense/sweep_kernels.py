"""The inner loops of the plane sweep.

The cost volume is laid out [row, plane, column]: one image row's costs at all planes fit the
cache. Rows are independent: results do not depend on the number of threads."""

from __future__ import annotations

import numpy as np
from numba import njit, prange

from airground.core.arrays import F32, F64, FAST, I16, I32, U16

COST_SCALE = 16.0
"""Costs are stored in sixteenths of a grey level."""
MAX_RUNS = 64
"""Most runs in a row: more would need a scale that no pair of neighbouring views has."""


@njit(cache=True, error_model="numpy")
def plan_columns(scale: F64, shift: F64, width: int) -> tuple[I32, I32, F32]:
    """Where the columns of the reference fall in a view, plane by plane, as gather-free runs.

    Column x falls on `scale * x + shift` (in half columns, see `TurnedView`). Over a run,
    the whole part of that minus 2 x is constant, so that neighbours are read in order.

    Returns:
        starts: (planes, MAX_RUNS) int32, first column of each run, `width` past the last.
        offsets: (planes, MAX_RUNS) int32, whole part minus 2 x.
        fractions: (planes, width) float32 in [0, 1).
    """
    planes = len(scale)
    starts = np.full((planes, MAX_RUNS), width, np.int32)
    offsets = np.zeros((planes, MAX_RUNS), np.int32)
    fractions = np.zeros((planes, width), np.float32)
    for p in range(planes):
        run = -1
        for x in range(width):
            u = scale[p] * x + shift[p]
            whole = int(np.floor(u))
            fractions[p, x] = u - whole
            if run < 0 or whole - 2 * x != offsets[p, run]:
                run += 1
                if run >= MAX_RUNS:
                    break
                starts[p, run] = x
                offsets[p, run] = whole - 2 * x
    return starts, offsets, fractions


@njit(cache=True, parallel=True, nogil=True, error_model="numpy", fastmath=FAST)
def add_view(
    costs: U16,
    first_view: bool,
    limits: I16,
    reference: F32,
    phases: F32,
    valid: I32,
    row_scale: F64,
    row_shift: F64,
    starts: I32,
    offsets: I32,
    fractions: F32,
    truncation: float,
) -> None:
    """Adds one view's truncated absolute differences to the cost volume.

    Args:
        costs: (height, planes, width) uint16 costs in sixteenths of grey levels, added to.
        first_view: Whether to overwrite `costs`.
        limits: (height, planes, 2) int16 columns [lo, hi) that the view covers; filled.
        reference: (height, width) float32 reference image.
        phases: (2, height, 2, width) float32 even and odd rows and columns of the view.
        valid: (2 * height, 2) int32 columns [lo, hi) of the view with data, row by row.
        row_scale, row_shift: (planes,) float64 maps of rows, as in `plan_columns`.
        starts, offsets, fractions: Result of `plan_columns`.
        truncation: Largest difference that counts [grey levels].
    """
    height, planes, width = costs.shape
    cap = np.float32(truncation)
    scale = np.float32(COST_SCALE)
    # Unsigned indices, since a slice for each run would take longer than the run.
    odd_begins, columns = np.uintp(width), np.uintp(width)
    for y in prange(height):
        if first_view:
            costs[y] = np.uint16(0)
        grey = reference[y]
        # The row of the view at a plane: even columns, then odd ones.
        line = np.empty(2 * width + 1, np.float32)
        for p in range(planes):
            v = row_scale[p] * y + row_shift[p]
            row = int(np.floor(v))
            limits[y, p, 0] = 0
            limits[y, p, 1] = 0
            if row < 0 or row + 1 >= 2 * height:
                continue
            lo = max(valid[row, 0], valid[row + 1, 0])
            hi = min(valid[row, 1], valid[row + 1, 1])
            if hi - lo < 4:
                continue
            weight = np.float32(v - row)
            even0 = phases[row & 1, row >> 1, 0]
            odd0 = phases[row & 1, row >> 1, 1]
            even1 = phases[(row + 1) & 1, (row + 1) >> 1, 0]
            odd1 = phases[(row + 1) & 1, (row + 1) >> 1, 1]
            for x in range(columns):
                line[x] = even0[x] + weight * (even1[x] - even0[x])
            for x in range(columns):
                line[odd_begins + x] = odd0[x] + weight * (odd1[x] - odd0[x])
            out, fraction = costs[y, p], fractions[p]
            first, last = width, 0
            for run in range(MAX_RUNS):
                begin = starts[p, run]
                if begin >= width:
                    break
                end = starts[p, run + 1] if run + 1 < MAX_RUNS else width
                offset = offsets[p, run]
                # 2 x + offset >= lo and 2 x + offset + 1 < hi
                begin = max(begin, (lo - offset + 1) >> 1)
                end = min(end, (hi - offset - 2) // 2 + 1)
                if end <= begin:
                    continue
                first, last = min(first, begin), max(last, end)
                left = np.uintp(offset >> 1)
                right = odd_begins + left
                if offset & 1:
                    left, right = right, left + np.uintp(1)
                for x in range(np.uintp(begin), np.uintp(end)):
                    sample = line[x + left] + fraction[x] * (line[x + right] - line[x + left])
                    difference = min(abs(sample - grey[x]), cap) * scale + np.float32(0.5)
                    out[x] = np.uint16(np.uint32(out[x]) + np.uint32(np.int32(difference)))
            if last > first:
                limits[y, p, 0] = first
                limits[y, p, 1] = last

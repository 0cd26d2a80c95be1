"""The depth of each pixel from its costs, and which depths not to believe (Sec. V)."""

from __future__ import annotations

import cv2
import numpy as np
from numba import njit, prange

from airground.config import PlaneSweep as Parameters
from airground.core.arrays import F32, FAST, U16, Mask
from airground.dense.aggregation import aggregate
from airground.dense.plane_sweep import PlaneSweep
from airground.dense.semiglobal import smooth

PARABOLA_REACH = 3
"""The parabola goes through the winner and the costs this many planes away: the planes are
finer than the cost's minimum is wide, so that next neighbours would mostly show noise."""
NOISE_OF_COST = 0.03
"""Standard deviation of an aggregated cost as a share of it (set on synthetic heaps)."""
SPECKLE_PX = 60
"""Connected patches of fewer pixels are dropped ..."""
SPECKLE_STEP_PLANES = 4.0
"""... where neighbours at most this many planes apart are connected."""


def depth_from_costs(sweep: PlaneSweep, parameters: Parameters) -> F32:
    """(height, width) depth [m] of a finished sweep, NaN where it is uncertain."""
    workspace = sweep.workspace
    mean = aggregate(
        sweep.volumes,
        parameters.window_px,
        parameters.truncation,
        parameters.one_side_penalty,
        workspace,
    )
    costs = mean
    if parameters.smoothing == "semiglobal":
        costs = smooth(mean, sweep.reference, parameters, workspace)
    inverse = 1.0 / sweep.depths
    shape = mean.shape[:2]
    plane, sigma = np.empty(shape, np.float32), np.empty(shape, np.float32)
    pick(costs, mean, plane, sigma)
    workspace.give(mean)
    if costs is not mean:
        workspace.give(costs)
    depth = 1.0 / (inverse[0] + plane * (inverse[1] - inverse[0]))
    sigma_m = sigma * depth**2 * abs(inverse[1] - inverse[0])
    # comparisons with NaN are false: what has no minimum is dropped here
    believed = sigma_m <= parameters.max_curvature_sigma_m
    believed &= ~_speckles(np.where(believed, plane, np.nan))
    return np.where(believed, depth, np.nan).astype(np.float32)


def _speckles(plane: F32) -> Mask:
    """Pixels in small patches that stand out from their surroundings."""
    scaled = np.where(np.isfinite(plane), plane * 16, -16).astype(np.int16)
    cleaned = scaled.copy()
    cv2.filterSpeckles(cleaned, -16, SPECKLE_PX, int(16 * SPECKLE_STEP_PLANES))
    result: Mask = (cleaned == -16) & (scaled != -16)
    return result


@njit(cache=True, parallel=True, nogil=True, error_model="numpy", fastmath=FAST)
def pick(costs: U16, mean: U16, plane: F32, sigma: F32) -> None:
    """The winning plane of each pixel, its sub-plane position and how sure it is.

    Args:
        costs: (height, width, planes) uint16 costs; the winner has the lowest.
        mean: (height, width, planes) uint16 mean costs without smoothing.
        plane: (height, width) float32 sub-plane index, NaN at either end; filled.
        sigma: (height, width) float32 standard deviation of the index; filled.
    """
    height, width, planes = costs.shape
    reach = PARABOLA_REACH
    for y in prange(height):
        for x in range(width):
            line, raw = costs[y, x], mean[y, x]
            best = np.uint16(65535)
            for p in range(planes):
                best = min(best, line[p])
            winner = 0
            while line[winner] != best:
                winner += 1
            plane[y, x], sigma[y, x] = np.nan, np.nan
            if winner < reach or winner >= planes - reach:
                continue
            before, after = np.float32(line[winner - reach]), np.float32(line[winner + reach])
            bend = before + after - np.float32(2) * np.float32(best)
            offset = np.float32(0)
            if bend > 0:
                offset = np.float32(0.5) * (before - after) / bend
            plane[y, x] = winner + reach * min(max(offset, np.float32(-1)), np.float32(1))
            here = np.float32(raw[winner])
            bend = np.float32(raw[winner - reach]) + np.float32(raw[winner + reach]) - 2 * here
            noise = np.float32(NOISE_OF_COST * 0.7071) * (here + np.float32(128))
            sigma[y, x] = reach * noise / bend if bend > 0 else np.float32(np.inf)

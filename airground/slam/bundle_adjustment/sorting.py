"""Observations in the order that the elimination of the points wants."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit

from airground.core.arrays import F64, I64
from airground.slam.bundle_adjustment.problem import Observations


@dataclass(frozen=True, eq=False)
class SortedObservations:
    """Observations by point and, within, by slot.

    Attributes:
        keyframes, points: (M,) int64 indices of each observation.
        slots: (M,) int64 number of the moving keyframe; -1 for one that does not move.
        measured: (M, 5) measurements for `residuals.linearize`.
        starts: (P + 1,) first observation of each point.
    """

    keyframes: I64
    points: I64
    slots: I64
    measured: F64
    starts: I64


def sort_observations(
    observations: Observations, slot_of: I64, point_count: int
) -> SortedObservations:
    """Sort; `slot_of` (K,) is -1 for keyframes that do not move.

    Raises:
        ValueError: A keyframe sees a point twice.
    """
    order, starts = _order(observations.keyframes, observations.points, slot_of, point_count)
    keyframes, points = observations.keyframes[order], observations.points[order]
    slots = slot_of[keyframes]
    twice = (points[1:] == points[:-1]) & (slots[1:] == slots[:-1]) & (slots[1:] >= 0)
    if twice.any():
        n = int(np.argmax(twice))
        raise ValueError(f"observations: keyframe {keyframes[n]} sees point {points[n]} twice")
    measured = np.empty((len(order), 5))
    measured[:, 0:2] = observations.pixels[order]
    measured[:, 2] = 1.0 / observations.sigmas_px[order]
    measured[:, 3] = observations.inverse_depths[order]
    measured[:, 4] = 1.0 / observations.inverse_depth_sigmas[order]
    return SortedObservations(keyframes, points, slots, measured, starts)


@njit(cache=True, nogil=True, error_model="numpy")
def _order(keyframes: I64, points: I64, slot_of: I64, point_count: int) -> tuple[I64, I64]:
    """Two stable counting sorts, by slot and then by point, and where each point starts."""
    count = len(keyframes)
    by_slot, _ = _counting_sort(slot_of[keyframes] + 1, len(slot_of) + 1, np.arange(count))
    return _counting_sort(points, point_count, by_slot)


@njit(cache=True, nogil=True, error_model="numpy")
def _counting_sort(keys: I64, key_count: int, order: I64) -> tuple[I64, I64]:
    """`order` sorted by the keys of what it names, and where each key starts (and the end)."""
    starts = np.zeros(key_count + 1, np.int64)
    for key in keys:
        starts[key + 1] += 1
    starts = np.cumsum(starts)
    free = starts.copy()
    sorted_order = np.empty(len(keys), np.int64)
    for m in order:
        key = keys[m]
        sorted_order[free[key]] = m
        free[key] += 1
    return sorted_order, starts

"""Observations in the order that the elimination of the points wants."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from airground.slam.bundle_adjustment.problem import Observations


@dataclass(frozen=True, eq=False)
class SortedObservations:
    """Observations by point and, within, by slot.

    Attributes:
        keyframes, points: (M,) int64.
        slots: (M,) int64, which moving keyframe; -1 for one that does not move.
        measured: (M, 5), as `residuals.linearize` takes it.
        starts: (P + 1,) first observation of each point.
    """

    keyframes: NDArray[np.int64]
    points: NDArray[np.int64]
    slots: NDArray[np.int64]
    measured: NDArray[np.float64]
    starts: NDArray[np.int64]


def sort_observations(
    observations: Observations, slot_of: NDArray[np.int64], point_count: int
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


@njit(cache=True, error_model="numpy")
def _order(
    keyframes: NDArray, points: NDArray, slot_of: NDArray, point_count: int
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Two stable counting sorts, by slot and then by point, and where each point starts."""
    count = len(keyframes)
    places = np.zeros(len(slot_of) + 2, np.int64)
    for m in range(count):
        places[slot_of[keyframes[m]] + 2] += 1
    places = np.cumsum(places)
    by_slot = np.empty(count, np.int64)
    for m in range(count):
        slot = slot_of[keyframes[m]] + 1
        by_slot[places[slot]] = m
        places[slot] += 1
    starts = np.zeros(point_count + 1, np.int64)
    for m in range(count):
        starts[points[m] + 1] += 1
    starts = np.cumsum(starts)
    places = starts.copy()
    order = np.empty(count, np.int64)
    for m in by_slot:
        order[places[points[m]]] = m
        places[points[m]] += 1
    return order, starts

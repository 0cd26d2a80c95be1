"""Plain normalized cross correlation of height maps, as the paper's [13] uses it.

It also equalizes the maps' relief, which ZMSSD does not: a flat place that correlates looks
as good as a heap that does.
"""

from __future__ import annotations

from evaluation.baselines.height_overlay import lowest_cost
from evaluation.baselines.seam import Answer, Given

RELIEF_FLOOR_M = 0.001
"""Ours holds relief above the maps' noise (`min_relief_m`); plain correlation has no such
floor, but sums in single precision mean nothing below this."""


def ncc_search(given: Given) -> Answer:
    """Lay the aerial height map where heights correlate best."""
    return lowest_cost(given, "ncc", RELIEF_FLOOR_M)

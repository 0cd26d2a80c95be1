"""The paper's cost, once and without particles: the offset of least ZMSSD (Eq. 2-3)."""

from __future__ import annotations

from evaluation.baselines.height_overlay import lowest_cost
from evaluation.baselines.seam import Answer, Given


def zmssd_search(given: Given) -> Answer:
    """Lay the aerial height map where heights differ least about their mean difference."""
    return lowest_cost(given, "zmssd", given.config.localization.min_relief_m)

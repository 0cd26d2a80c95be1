"""Whether a map repeats itself, so that places in it look the same.

Along a row of identical boxes every period fits alike. Particles gather in one of several equal
places by chance, and where the ground map ends a wrong place may be the only one left. So the
aerial map is laid over itself, and the part of the ground map under it over all of the ground map:
maps of one robot fit better than those of two."""

from __future__ import annotations

import numpy as np
from scipy import ndimage

from airground.config import Localization
from airground.core.belief import HeightMap
from airground.core.height_map import lattice_index
from airground.localization.cost_kernels import one_minus_correlation
from airground.localization.cost_map import OffsetSearch, reach_of

LONGEST_SHIFT_M = 3.0
"""Longest shift that is looked at, along x and along y [m]. Rows of boxes repeat after less; maps
shifted further share so few cells that some shift fits by chance."""


def repetition(patch: HeightMap, within: HeightMap, cells: int, config: Localization) -> float:
    """Distance by which a map can be shifted to fit another again [m]; infinite without any.

    Shifts with a share `min_overlap` of so many cells and a correlation of `max_self_similarity`
    count, apart from those around 0: maps of wide shapes fit themselves there."""
    radius_m = min(LONGEST_SHIFT_M, config.search_radius_m)
    search = OffsetSearch(within, (0.0, 0.0), radius_m, reach_of(patch))
    sums = search.sums(patch).reshape(-1, 6)
    costs = one_minus_correlation(sums, config.min_overlap * cells, config.min_relief_m)
    alike, _ = ndimage.label(1 - costs.reshape(search.shape) > config.max_self_similarity)
    elsewhere = np.argwhere((alike > 0) & (alike != alike[tuple(-search.first)]))
    if len(elsewhere) == 0:
        return float("inf")
    return float(np.hypot(*(elsewhere + search.first).T).min()) / patch.cells_per_m


def why_ambiguous(
    aerial: HeightMap, laid: HeightMap, ground: HeightMap, config: Localization
) -> str:
    """The reason, in one line, why no place can be claimed; empty if one can.

    `laid` is the aerial map where it would be claimed, in the frame of the ground map."""
    for name, patch, within in (
        ("aerial", aerial, aerial),
        ("ground", _under(laid, ground), ground),
    ):
        shift_m = repetition(patch, within, aerial.filled_cells, config)
        if np.isfinite(shift_m):
            return f"self-similar: shifted by {shift_m:.2f} m, the {name} map fits itself"
    return ""


def _under(laid: HeightMap, ground: HeightMap) -> HeightMap:
    """The ground map where an aerial map lies on it."""
    heights = np.full(laid.heights.shape, np.nan, np.float32)
    start = lattice_index(laid) - lattice_index(ground)
    low = np.maximum(start, 0)
    high = np.minimum(start + laid.heights.shape, ground.heights.shape)
    if (low < high).all():
        there = tuple(slice(*pair) for pair in zip(low, high, strict=True))
        here = tuple(slice(*pair) for pair in zip(low - start, high - start, strict=True))
        heights[here] = ground.heights[there]
    heights[np.isnan(laid.heights)] = np.nan
    return HeightMap(heights, laid.origin, laid.cells_per_m)

"""Whether an aerial map repeats itself, so that places in it look the same.

Along a row of identical boxes every period fits the ground map alike. Where that map ends, or where
the particles have gathered in one of several equal places by chance, a wrong place may look like
the only one; the aerial map alone shows that it is not."""

from __future__ import annotations

import numpy as np
from scipy import ndimage

from airground.config import Localization
from airground.core.belief import HeightMap
from airground.localization.cost_kernels import one_minus_correlation
from airground.localization.cost_map import OffsetSearch, reach_of


def repetition(aerial: HeightMap, config: Localization) -> float:
    """Distance by which a map can be shifted to fit itself again [m]; infinite without any.

    Shifts with an overlap of `min_overlap` and a correlation of `max_self_similarity` count, apart
    from those around 0: maps of wide shapes fit themselves there."""
    reach = reach_of(aerial)
    # Farther shifts overlap less, unless the map has holes.
    farthest = (1 - config.min_overlap) * (reach[1] - reach[0] + 1).max()
    radius_m = float(farthest) / aerial.cells_per_m
    search = OffsetSearch(aerial, (0.0, 0.0), radius_m, reach)
    sums = search.sums(aerial).reshape(-1, 6)
    least = config.min_overlap * aerial.filled_cells
    costs = one_minus_correlation(sums, least, config.min_relief_m).reshape(search.shape)
    alike, _ = ndimage.label(1 - costs > config.max_self_similarity)
    elsewhere = np.argwhere((alike > 0) & (alike != alike[tuple(-search.first)]))
    if len(elsewhere) == 0:
        return float("inf")
    return float(np.hypot(*(elsewhere + search.first).T).min()) / aerial.cells_per_m


def why_ambiguous(aerial: HeightMap, config: Localization) -> str:
    """The reason, in one line, why an aerial map can claim no position; empty if it can."""
    shift_m = repetition(aerial, config)
    if not np.isfinite(shift_m):
        return ""
    return f"self-similar: shifted by {shift_m:.2f} m, the aerial map fits itself"

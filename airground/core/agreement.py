"""Whether two overlaid height maps agree by more than chance.

The measure is Cohen's kappa: how far the share of agreeing cells exceeds the share that the same
maps reach when shifted to wrong places. Two heaps on a floor agree over half of their area at any
place. Kappa is near zero on flat ground, on a slope, along a ridge and in a regular pattern."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from airground.core.arrays import F32, I64
from airground.core.belief import HeightMap
from airground.core.height_map import lattice_index

TOLERANCE_M = 0.05
"""Largest height difference of agreeing cells, off their median [m]."""
SHIFT_M = 0.4
"""Distance of the wrong places that show chance [m]."""
DIRECTIONS = 16
MIN_CELLS = 50


@dataclass(frozen=True)
class Agreement:
    """How well two overlaid height maps agree.

    Attributes:
        cells: Number of cells filled in both maps.
        share: Share of them within the tolerance of the median height difference; 0 if few overlap.
        chance: Highest share at 16 places shifted to all sides.
    """

    cells: int
    share: float
    chance: float

    @property
    def kappa(self) -> float:
        """Agreement beyond chance: 1 is perfect, 0 is what any other place would give."""
        return (self.share - self.chance) / max(1.0 - self.chance, 1e-6)


def agreement(aerial: HeightMap, ground: HeightMap, scale: float = 1.0) -> Agreement:
    """Compare two maps in one frame, on one lattice, and the same maps shifted apart.
    `scale` multiplies the tolerance and the shift, for maps that are wider or coarser."""
    tolerance_m = scale * TOLERANCE_M
    first = lattice_index(aerial) - lattice_index(ground)
    angles = 2 * np.pi * np.arange(DIRECTIONS) / DIRECTIONS
    ring = scale * SHIFT_M * aerial.cells_per_m * np.column_stack([np.cos(angles), np.sin(angles)])
    cells, share = _agreeing(aerial.heights, ground.heights, first, tolerance_m)
    shifted = [
        _agreeing(aerial.heights, ground.heights, first + s, tolerance_m)
        for s in np.rint(ring).astype(int)
    ]
    # A shift that leaves less than half of the overlap is no fair comparison.
    fair = [other for count, other in shifted if count >= cells / 2]
    return Agreement(cells, share, max(fair, default=1.0))


def _agreeing(aerial: F32, ground: F32, first: I64, tolerance_m: float) -> tuple[int, float]:
    """Overlapping cells and the share that agrees, with aerial [0, 0] at `first` in ground."""
    low = np.maximum(-first, 0)
    high = np.minimum(aerial.shape, np.array(ground.shape) - first)
    if (low >= high).any():
        return 0, 0.0
    a = aerial[low[0] : high[0], low[1] : high[1]]
    g = ground[low[0] + first[0] : high[0] + first[0], low[1] + first[1] : high[1] + first[1]]
    difference = (g - a)[np.isfinite(a) & np.isfinite(g)]
    if len(difference) < MIN_CELLS:
        return len(difference), 0.0
    near = np.abs(difference - np.median(difference)) < tolerance_m
    return len(difference), float(near.mean())

"""All hypotheses at once: positions, and where it is unknown the heading too (Sec. VI-A)."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
from numba import get_num_threads
from numpy.typing import ArrayLike

from airground.config import Localization
from airground.core.arrays import F32, F64, I64
from airground.core.belief import CostMap, HeightMap
from airground.core.height_map import lattice_index, make_height_map
from airground.localization.channels import ChannelSearch, every, floor_of, stride_of
from airground.localization.cost_map import OffsetSearch, reach_of
from airground.localization.particles import draw_cells

COARSE_STEP_DEG = 4.0
REFINED_MODES = 12
NEAR_M, NEAR_DEG = 0.5, 15.0
"""Reach of one place in a volume of costs [m], [deg]: beyond, another place fits."""


@dataclass(frozen=True, eq=False)
class CostVolume:
    """Costs over headings and positions.

    Attributes:
        headings: (H,) turn of `mav` in `ground` [rad], ascending.
        costs: (H, nx, ny) float32, NaN where the overlap is too small.
        origin: (2,) the position of cell [0, 0] in `ground` [m].
        cells_per_m: Resolution.
    """

    headings: F64
    costs: F32
    origin: F64
    cells_per_m: float

    @property
    def feasible(self) -> bool:
        """Whether any hypothesis overlaps enough."""
        return bool(np.isfinite(self.costs).any())

    def cost_map(self, cost: str) -> CostMap:
        """The slice of the heading with the lowest cost."""
        best = 0
        if self.feasible:
            best = int(np.unravel_index(np.nanargmin(self.costs), self.costs.shape)[0])
        heading = float(self.headings[best])
        return CostMap(self.costs[best], self.origin, self.cells_per_m, heading, cost)

    def lead(self, pose: F64) -> float:
        """Lowest cost elsewhere minus the lowest near a pose (3,), x, y [m] and heading [rad].
        Places without a cost count as 0, which is chance where costs are logarithms."""
        costs = np.nan_to_num(self.costs)
        x, y = (
            self.origin[axis] + np.arange(costs.shape[1 + axis]) / self.cells_per_m - pose[axis]
            for axis in (0, 1)
        )
        off = np.angle(np.exp(1j * (self.headings - pose[2])))
        near = np.abs(off)[:, None, None] <= np.deg2rad(NEAR_DEG)
        near = near & (np.hypot(x[:, None], y) <= NEAR_M)
        return float(costs.min(where=~near, initial=0.0) - costs.min(where=near, initial=0.0))

    def draw(self, count: int, sigma: float, rng: np.random.Generator) -> F64:
        """(count, 3) hypotheses by Eq. 5, spread evenly within their cells; uniform if none fit."""
        costs = self.costs if self.feasible else np.zeros_like(self.costs)
        turn, ix, iy = draw_cells(costs, sigma, count, rng)
        cells = np.column_stack([ix, iy]) + rng.uniform(-0.5, 0.5, (count, 2))
        return np.column_stack([self.origin + cells / self.cells_per_m, self.headings[turn]])


def search_positions(
    aerial: HeightMap, ground: HeightMap, centre: ArrayLike, heading: float, config: Localization
) -> CostVolume:
    """Every position within the search region for a known heading (Eq. 2)."""
    search = _search(aerial, ground, centre, reach_of(aerial), config)
    costs = search.costs(aerial, config)[None]
    return CostVolume(
        np.array([heading]), costs, search.first / search.cells_per_m, search.cells_per_m
    )


def search_headings(
    aerial: HeightMap, ground: HeightMap, centre: ArrayLike, config: Localization
) -> CostVolume:
    """Every position for headings all around, coarse to fine.

    First every 4 degrees, then all between the most promising ones. Costs are exact for each
    heading in the volume. The aerial map is for heading 0."""
    cells = _cells(aerial)
    reach = (
        int(np.ceil(np.linalg.norm(cells[:, :2], axis=1).max(initial=0) * aerial.cells_per_m)) + 1
    )
    reach_cells = np.array([[-reach, -reach], [reach, reach]])
    search = _search(aerial, ground, centre, reach_cells, config)
    step = max(1, int(COARSE_STEP_DEG / 360.0 * config.headings))

    def costs_of(turn: int) -> F32:
        return _costs_turned(search, cells, turn, aerial.cells_per_m, config)

    coarse = list(range(0, config.headings, step))
    with ThreadPoolExecutor(get_num_threads()) as pool:
        found = dict(zip(coarse, pool.map(costs_of, coarse), strict=True))
        lowest = {turn: np.nanmin(c) for turn, c in found.items() if np.isfinite(c).any()}
        promising = sorted(lowest, key=lambda turn: lowest[turn])[:REFINED_MODES]
        near = {(t + d) % config.headings for t in promising for d in range(1 - step, step)}
        fine = sorted(near - found.keys())
        found.update(zip(fine, pool.map(costs_of, fine), strict=True))
    turns = sorted(found)
    headings = np.array(turns) * 2 * np.pi / config.headings
    costs = np.stack([found[turn] for turn in turns])
    return CostVolume(headings, costs, search.first / search.cells_per_m, search.cells_per_m)


def _search(
    aerial: HeightMap, ground: HeightMap, centre: ArrayLike, reach_cells: I64, config: Localization
) -> OffsetSearch | ChannelSearch:
    """The search of the configured cost."""
    if config.cost != "channels":
        return OffsetSearch(ground, centre, config.search_radius_m, reach_cells)
    floor = floor_of(every(aerial, stride_of(aerial.cells_per_m)))
    return ChannelSearch(ground, floor, centre, config.search_radius_m, reach_cells)


def _cells(aerial: HeightMap) -> F32:
    """(K, 3) centres and heights of the filled cells."""
    ix, iy = np.nonzero(np.isfinite(aerial.heights))
    xy = (np.column_stack([ix, iy]) + lattice_index(aerial)) / aerial.cells_per_m
    return np.column_stack([xy, aerial.heights[ix, iy]]).astype(np.float32)


def _costs_turned(
    search: OffsetSearch | ChannelSearch,
    cells: F32,
    turn: int,
    cells_per_m: float,
    config: Localization,
) -> F32:
    angle = 2 * np.pi * turn / config.headings
    c, s = np.float32(np.cos(angle)), np.float32(np.sin(angle))
    turned = cells.copy()
    turned[:, 0] = c * cells[:, 0] - s * cells[:, 1]
    turned[:, 1] = s * cells[:, 0] + c * cells[:, 1]
    # Turned lattices leave pinholes, which the dilation closes.
    return search.costs(make_height_map(turned, cells_per_m), config)

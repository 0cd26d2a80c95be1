"""Cost of laying an aerial height map over the ground robot's, by the area where heights agree.

A correlation weighs differences by their squares: few cells that cannot fit, of boxes that were
moved or of sides that one robot has not seen, outweigh all others. Here they count as their area.
Costs are of every second cell or so: the share of an area needs no more."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from airground.config import Localization
from airground.core.arrays import F32, F64, I64
from airground.core.belief import HeightMap
from airground.core.height_map import lattice_index
from airground.localization.channel_kernels import (
    AERIAL,
    CHANNELS,
    GROUND,
    SHIFTS,
    SUMS,
    channel_sums,
    in_channels,
    levels_above,
    lifted_channel,
    log_agreement_ratio,
)
from airground.localization.offset_grid import OffsetGrid

CELLS_PER_M = 12.5
"""Resolution about which cells are looked at [cells/m]."""
FLOOR_BIN_M = 0.02


def floor_of(height_map: HeightMap) -> float:
    """Height at which most filled cells of a map are [m]; 0 without any."""
    heights = height_map.heights[np.isfinite(height_map.heights)]
    if len(heights) == 0:
        return 0.0
    bins, counts = np.unique(np.floor(heights / FLOOR_BIN_M), return_counts=True)
    return float((bins[counts.argmax()] + 0.5) * FLOOR_BIN_M)


class ChannelSearch(OffsetGrid):
    """Costs of all offsets by whole cells that are looked at, in the frequency domain.

    The agreeing area is one correlation, of the sum over the channels of products of spectra. The
    ground's spectra are kept for further headings.

    Args:
        ground: Height map in the frame `ground`.
        aerial_floor: Height of the aerial map's floor [m], whatever its heading.
        centre: (2,) middle of the searched square [m].
        radius_m: Half its side [m].
        reach_cells: (2, 2) first and last lattice index from the camera of an aerial map.
    """

    def __init__(
        self,
        ground: HeightMap,
        aerial_floor: float,
        centre: ArrayLike,
        radius_m: float,
        reach_cells: I64,
    ) -> None:
        self._stride = stride_of(ground.cells_per_m)
        few = every(ground, self._stride)
        reach = np.array([-(-reach_cells[0] // self._stride), reach_cells[1] // self._stride])
        super().__init__(centre, radius_m, reach, few.cells_per_m)
        self._aerial_floor = aerial_floor
        channels = in_channels(levels_above(self.under_offsets(few), floor_of(few)))
        self._channels = [self.spectrum(channel) for channel in channels]
        self._mask = self.spectrum(channels.sum(axis=0))

    def sums(self, aerial: HeightMap) -> F32:
        """(nx, ny, SUMS) sums as in `channel_kernels` at every offset."""
        few = self.within_reach(every(aerial, self._stride))
        weights = in_channels(levels_above(few, self._aerial_floor))
        channels = [np.conj(self.spectrum(channel)) for channel in weights]
        mask = np.conj(self.spectrum(weights.sum(axis=0)))
        sums = np.empty((*self.shape, SUMS), np.float32)
        product = np.empty_like(mask)
        for k, shift in enumerate(SHIFTS):
            agreed = np.zeros_like(mask)
            for index, channel in enumerate(channels):
                np.multiply(channel, self._channels[lifted_channel(index, shift)], out=product)
                agreed += product
            self.correlate(agreed, sums[..., k])
        for index in range(CHANNELS):
            np.multiply(channels[index], self._mask, out=product)
            self.correlate(product, sums[..., AERIAL + index])
            np.multiply(mask, self._channels[index], out=product)
            self.correlate(product, sums[..., GROUND + index])
        return sums

    def costs(self, aerial: HeightMap, config: Localization) -> F32:
        """(nx, ny) cost at every offset, NaN where too little overlaps."""
        sums = self.sums(aerial).reshape(-1, SUMS)
        cells = every(aerial, self._stride).filled_cells
        return costs_of(sums, cells, self.cells_per_m, config).reshape(self.shape)


@dataclass(frozen=True, eq=False)
class ChannelOverlay:
    """An aerial height map and the ground's, for costs at single hypotheses.

    Attributes:
        places, levels: (2, K) and (K, S) aerial cells as `channel_sums` takes them.
        ground: (nx, ny) ground as `channel_sums` takes it.
        first: (2,) lattice index of the first cell of `ground`.
        cells_per_m, stride: Resolution of the ground; every so many of its cells are looked at.
    """

    places: F32
    levels: F32
    ground: F32
    first: I64
    cells_per_m: float
    stride: int

    @classmethod
    def of(cls, aerial: HeightMap, ground: HeightMap) -> ChannelOverlay:
        """Of two maps of one resolution."""
        stride = stride_of(ground.cells_per_m)
        few = every(aerial, stride)
        levels = levels_above(few.heights, floor_of(few))
        filled = np.nonzero(np.isfinite(levels))
        places = (np.column_stack(filled) + lattice_index(few)) * stride
        lifted = levels[filled][:, None] + np.array(SHIFTS, np.float32)
        return cls(
            np.ascontiguousarray(places.T, np.float32),
            np.clip(lifted, 0, CHANNELS - 1),
            levels_above(ground.heights, floor_of(every(ground, stride))),
            lattice_index(ground),
            ground.cells_per_m,
            stride,
        )

    def costs(self, poses: F64, config: Localization) -> F32:
        """(M,) costs of poses (M, 3), x, y [m] and turn [rad]; NaN where too little overlaps."""
        in_cells = np.array(poses, np.float64)
        in_cells[:, :2] = in_cells[:, :2] * self.cells_per_m - self.first
        sums = channel_sums(self.places, self.levels, self.ground, in_cells)
        return costs_of(sums, self.places.shape[1], self.cells_per_m / self.stride, config)


def costs_of(sums: F32 | F64, aerial_cells: int, cells_per_m: float, config: Localization) -> F32:
    """(N,) costs for sums (N, SUMS) as in `channel_kernels`, of cells at a resolution."""
    least = float(np.floor(config.min_overlap * aerial_cells) + 0.5)
    return log_agreement_ratio(sums, least, (config.patch_m * cells_per_m) ** 2)


def stride_of(cells_per_m: float) -> int:
    """How many cells lie between those that are looked at, at least 1."""
    return max(1, round(cells_per_m / CELLS_PER_M))


def every(height_map: HeightMap, stride: int) -> HeightMap:
    """Every so many cells of a map, on the lattice of cells so much larger."""
    first = lattice_index(height_map)
    skipped = -first % stride
    heights = height_map.heights[skipped[0] :: stride, skipped[1] :: stride]
    cells_per_m = height_map.cells_per_m / stride
    if heights.size == 0:
        heights = np.full((1, 1), np.nan, np.float32)
    origin = (first + skipped) / height_map.cells_per_m
    return HeightMap(np.ascontiguousarray(heights), origin, cells_per_m)

"""The cost of laying an aerial height map over the ground robot's (Sec. VI-A, Eq. 2-3)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from airground.config import Localization
from airground.core.arrays import C64, F32, F64, I64, Floats
from airground.core.belief import HeightMap
from airground.core.height_map import lattice_index
from airground.localization.cost_kernels import (
    COUNT,
    SUM_A,
    SUM_AA,
    SUM_AG,
    SUM_G,
    SUM_GG,
    VECTOR_CELLS,
    about_mean,
    difference_spectrum,
    log_likelihood_ratio,
    one_minus_correlation,
    squares_spectrum,
    sums_at_positions,
    zmssd,
    zmssd_of_differences,
)
from airground.localization.offset_grid import OffsetGrid
from airground.localization.turned_kernels import MARGIN, filled_cells, in_fours, sums_at_poses


@dataclass(frozen=True, eq=False)
class Masked:
    """Heights about their mean with 0 in holes, and the mask of the filled cells.
    float32 sums of squares lose small differences unless the mean is subtracted first."""

    heights: F32
    mask: F32
    mean: float


def masked(heights: F32, margin: int = 0, after: int = 0) -> Masked:
    """Split heights with NaN into values and mask, with `margin` empty cells around, and `after`
    more empty columns."""
    return Masked(*about_mean(heights, margin, after))


def costs_of(sums: Floats, aerial_cells: int, cells_per_m: float, config: Localization) -> F32:
    """(N,) costs of the configured kind for sums (N, 6) as in `cost_kernels`.
    ValueError for `channels`, which has other sums."""
    min_count = least_count(aerial_cells, config)
    match config.cost:
        case "zmssd":
            return zmssd(sums, min_count)
        case "ncc":
            return one_minus_correlation(sums, min_count, config.min_relief_m)
        case "likelihood":
            cells_of_patch = (config.patch_m * cells_per_m) ** 2
            return log_likelihood_ratio(sums, min_count, config.min_relief_m, cells_of_patch)
        case "channels":
            raise ValueError("the cost of channels is that of channels.py")


class OffsetSearch(OffsetGrid):
    """Costs of all whole-cell offsets at once, by correlations in the frequency domain.

    Every sum over the overlap is a correlation of masked maps, so six products of spectra
    give the exact cost of all offsets. The ground's spectra are kept for further headings.

    Args:
        ground: Height map in the frame `ground`.
        centre: (2,) middle of the searched square [m].
        radius_m: Half its side [m].
        reach_cells: (2, 2) first and last lattice index from the camera of an aerial map.
    """

    def __init__(
        self, ground: HeightMap, centre: ArrayLike, radius_m: float, reach_cells: I64
    ) -> None:
        super().__init__(centre, radius_m, reach_cells, ground.cells_per_m)
        self._spectra = self._transform(masked(self.under_offsets(ground)))

    def sums(self, aerial: HeightMap) -> F32:
        """(nx, ny, 6) sums over the overlap at every offset; heights are about the means."""
        mask_a, a, aa = self._aerial_spectra(aerial)
        mask_g, g, gg = self._spectra
        sums = np.empty((*self.shape, 6), np.float32)
        pairs = ((mask_a, mask_g), (a, mask_g), (mask_a, g), (aa, mask_g), (mask_a, gg), (a, g))
        product = np.empty_like(mask_g)
        for index, (aerial_spectrum, ground_spectrum) in enumerate(pairs):
            np.multiply(aerial_spectrum, ground_spectrum, out=product)
            self.correlate(product, sums[..., index])
        np.rint(sums[..., COUNT], out=sums[..., COUNT])
        return sums

    def difference_sums(self, aerial: HeightMap) -> F32:
        """(nx, ny, 3) at every offset: number of overlapping cells, and sums over them of the
        height differences, aerial minus ground, and of their squares; heights are about the means.

        Sums are linear: they are combined before they are transformed back."""
        mask_a, a, aa = self._aerial_spectra(aerial)
        mask_g, g, gg = self._spectra
        sums = np.empty((*self.shape, 3), np.float32)
        product = np.empty_like(mask_g)
        np.multiply(mask_a, mask_g, out=product)
        self.correlate(product, sums[..., 0])
        difference_spectrum(mask_a, a, mask_g, g, product)
        self.correlate(product, sums[..., 1])
        squares_spectrum(mask_a, a, aa, mask_g, g, gg, product)
        self.correlate(product, sums[..., 2])
        np.rint(sums[..., COUNT], out=sums[..., COUNT])
        return sums

    def costs(self, aerial: HeightMap, config: Localization) -> F32:
        """(nx, ny) cost at every offset, NaN where too little overlaps."""
        if config.cost == "zmssd":
            differences = self.difference_sums(aerial).reshape(-1, 3)
            costs = zmssd_of_differences(differences, least_count(aerial.filled_cells, config))
        else:
            sums = self.sums(aerial).reshape(-1, 6)
            costs = costs_of(sums, aerial.filled_cells, self.cells_per_m, config)
        return costs.reshape(self.shape)

    def _aerial_spectra(self, aerial: HeightMap) -> tuple[C64, C64, C64]:
        """Conjugate spectra of the mask, the heights and their squares of an aerial map."""
        spectra = self._transform(masked(self.within_reach(aerial)))
        mask_a, a, aa = (np.conj(s, out=s) for s in spectra)
        return mask_a, a, aa

    def _transform(self, patch: Masked) -> tuple[C64, C64, C64]:
        spectrum = self.spectrum
        return spectrum(patch.mask), spectrum(patch.heights), spectrum(patch.heights**2)


def reach_of(aerial: HeightMap) -> I64:
    """(2, 2) first and last lattice index of a map."""
    first = lattice_index(aerial)
    return np.array([first, first + aerial.heights.shape - 1])


def least_count(aerial_cells: int, config: Localization) -> float:
    """Least number of cells of an overlap that counts: "more than" the fraction (Sec. VI-A), where
    the number of cells is whole."""
    return float(np.floor(config.min_overlap * aerial_cells) + 0.5)


@dataclass(frozen=True, eq=False)
class Overlays:
    """Overlaps of an aerial and a ground height map at single hypotheses.

    Attributes:
        sums: (M, 6) sums as in `cost_kernels`, of heights about the maps' means.
        mean_aerial, mean_ground: Mean heights [m], of the ground where an overlay can reach.
        aerial_cells: Number of filled cells of the aerial map.
        cells_per_m: Resolution.
    """

    sums: F64
    mean_aerial: float
    mean_ground: float
    aerial_cells: int
    cells_per_m: float

    def costs(self, config: Localization) -> F32:
        """(M,) costs, NaN where too little overlaps."""
        return costs_of(self.sums, self.aerial_cells, self.cells_per_m, config)

    def overlaps(self) -> F64:
        """(M,) overlap as a fraction of the aerial map's filled cells."""
        return self.sums[:, COUNT] / max(self.aerial_cells, 1)

    def correlations(self) -> F64:
        """(M,) normalized correlations of the heights, NaN without any overlap."""
        count = self.sums[:, COUNT]
        with np.errstate(invalid="ignore", divide="ignore"):
            covariance = self.sums[:, SUM_AG] - self.sums[:, SUM_A] * self.sums[:, SUM_G] / count
            variance_a, variance_g = self._variances()
            return covariance / count / np.sqrt(variance_a * variance_g)

    def reliefs(self) -> F64:
        """(M,) the smaller of both maps' standard deviations over the overlap [m]."""
        return np.sqrt(np.minimum(*self._variances()))

    def _variances(self) -> tuple[F64, F64]:
        count = self.sums[:, COUNT]
        with np.errstate(invalid="ignore", divide="ignore"):
            aerial = self.sums[:, SUM_AA] / count - (self.sums[:, SUM_A] / count) ** 2
            ground = self.sums[:, SUM_GG] / count - (self.sums[:, SUM_G] / count) ** 2
        return np.maximum(aerial, 1e-12), np.maximum(ground, 1e-12)

    def height_offsets(self) -> F64:
        """(M,) Delta z = mean ground - mean aerial height over the overlap [m] (Sec. VI-A)."""
        with np.errstate(invalid="ignore", divide="ignore"):
            difference = (self.sums[:, SUM_G] - self.sums[:, SUM_A]) / self.sums[:, COUNT]
        return difference + self.mean_ground - self.mean_aerial


def overlay_at(aerial: HeightMap, ground: HeightMap, positions: F64) -> Overlays:
    """Lay the aerial map at M positions u (M, 2) [m] over the ground map, bilinearly."""
    places = np.asarray(positions, np.float64) * ground.cells_per_m
    heights, first = _within_reach(ground, places, reach_of(aerial))
    a = masked(aerial.heights, after=VECTOR_CELLS)
    g = masked(heights, margin=1, after=VECTOR_CELLS)
    shifts = places + (lattice_index(aerial) - first + 1)
    sums = sums_at_positions(a.heights, a.mask, g.heights, g.mask, shifts)
    return Overlays(sums, a.mean, g.mean, aerial.filled_cells, ground.cells_per_m)


def overlay_turned(aerial: HeightMap, ground: HeightMap, poses: F64) -> Overlays:
    """The same for M poses (M, 3): x, y [m], and a turn of the aerial map [rad]."""
    poses = np.array(poses, np.float64)
    poses[:, :2] *= ground.cells_per_m
    farthest = int(np.ceil(np.linalg.norm(np.abs(reach_of(aerial)).max(axis=0))))
    reach = np.array([[-farthest, -farthest], [farthest, farthest]])
    heights, first = _within_reach(ground, poses[:, :2], reach)
    cells, mean_aerial = filled_cells(aerial.heights, *lattice_index(aerial))
    fours, mean_ground = in_fours(heights)
    poses[:, :2] += MARGIN - first
    sums = sums_at_poses(cells, fours, poses)
    return Overlays(sums, mean_aerial, mean_ground, cells.shape[1], ground.cells_per_m)


def _within_reach(ground: HeightMap, places: F64, reach_cells: I64) -> tuple[F32, I64]:
    """Ground heights that aerial maps at `places` (M, 2) [cells] can reach, and their first cell.
    Particles gather: to prepare the whole ground map would take longer than to use it."""
    edge = lattice_index(ground)
    low = np.floor(places.min(axis=0)).astype(np.int64) + reach_cells[0] - edge
    high = np.floor(places.max(axis=0)).astype(np.int64) + reach_cells[1] + 2 - edge
    low = np.clip(low, 0, ground.heights.shape)
    high = np.clip(high, low, ground.heights.shape)
    return ground.heights[low[0] : high[0], low[1] : high[1]].copy(), edge + low

"""Whole-cell offsets of an aerial height map over the ground's, and correlations at all of them."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike
from scipy import fft

from airground.core.arrays import C64, F32, I64
from airground.core.belief import HeightMap
from airground.core.height_map import lattice_index


class OffsetGrid:
    """All whole-cell offsets within the search region, and the arrays that reach them.

    Attributes:
        first: (2,) lattice index of the first offset.
        shape: (2,) number of offsets along x and y.
        cells_per_m: Resolution.

    Args:
        centre: (2,) middle of the searched square [m].
        radius_m: Half its side [m].
        reach_cells: (2, 2) first and last lattice index from the camera of an aerial map.
        cells_per_m: Resolution.
    """

    def __init__(
        self, centre: ArrayLike, radius_m: float, reach_cells: I64, cells_per_m: float
    ) -> None:
        centre, scale = np.asarray(centre, np.float64), cells_per_m
        self.first = np.ceil((centre - radius_m) * scale - 1e-6).astype(np.int64)
        self.shape = np.floor((centre + radius_m) * scale + 1e-6).astype(np.int64) - self.first + 1
        self.cells_per_m = scale
        self._reach = np.asarray(reach_cells, np.int64)
        self._extent = self.shape + self._reach[1] - self._reach[0]
        self._fft_shape = [fft.next_fast_len(int(n), real=True) for n in self._extent]

    def under_offsets(self, ground: HeightMap) -> F32:
        """The ground heights that some offset lays an aerial map over, NaN outside the map."""
        start = self.first + self._reach[0] - lattice_index(ground)
        return _window(ground.heights, start, self._extent)

    def within_reach(self, aerial: HeightMap) -> F32:
        """The heights of an aerial map over the whole reach, NaN around."""
        offset = lattice_index(aerial) - self._reach[0]
        size = self._reach[1] - self._reach[0] + 1
        if not ((offset >= 0).all() and (offset + aerial.heights.shape <= size).all()):
            raise ValueError("the aerial map is larger than the given reach")
        canvas = np.full(tuple(size), np.nan, np.float32)
        nx, ny = aerial.heights.shape
        canvas[offset[0] : offset[0] + nx, offset[1] : offset[1] + ny] = aerial.heights
        return canvas

    def spectrum(self, image: F32) -> C64:
        """`rfft2` of the image with zeros around, not spent on the rows that are all zeros."""
        rows, columns = self._fft_shape
        result: C64 = fft.fft(fft.rfft(image, columns, axis=1), rows, axis=0, overwrite_x=True)
        return result

    def correlate(self, product: C64, out: F32) -> None:
        """`irfft2` of a product of spectra, for the rows of offsets only.
        The product is overwritten: fresh memory costs as much time as the multiplication."""
        rows, columns = self._fft_shape
        spectra = fft.ifft(product, axis=0, norm="forward", overwrite_x=True)
        lines = fft.irfft(spectra[: len(out)], columns, axis=1, norm="forward", overwrite_x=True)
        np.multiply(lines[:, : out.shape[1]], np.float32(1 / (rows * columns)), out=out)


def _window(heights: F32, start: I64, extent: I64) -> F32:
    """The cells from `start` over `extent`, NaN outside the map."""
    window = np.full(tuple(extent), np.nan, np.float32)
    low = np.maximum(start, 0)
    high = np.minimum(start + extent, heights.shape)
    if (low < high).all():
        inside = tuple(slice(*pair) for pair in zip(low - start, high - start, strict=True))
        window[inside] = heights[low[0] : high[0], low[1] : high[1]]
    return window

"""From points to height maps: the projection that makes two robots' views comparable."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import ArrayLike

from airground.core.arrays import F32, I64, Floats
from airground.core.belief import HeightMap


def make_height_map(
    points: Floats,
    cells_per_m: float,
    dilate_holes: bool = True,
    window: tuple[ArrayLike, ArrayLike] | None = None,
) -> HeightMap:
    """Highest point over each cell of the ground plane (Sec. VI-A).

    Cell centres are whole multiples of the cell size: maps of one resolution share a lattice.

    Args:
        points: (N, 3) [m], z against gravity; points with a NaN are left out.
        cells_per_m: Resolution.
        dilate_holes: Fill each hole by the highest of its 3 x 3 neighbours.
        window: Lowest and highest (x, y) [m] of the map; around all points where None.

    Returns:
        The map in the frame of the points; one empty cell where there are no points.
    """
    points = np.ascontiguousarray(points, np.float32)
    scale = np.float32(cells_per_m)
    if window is None:
        extent = _cell_extent(points, scale)
        first, last = extent if (extent[0] <= extent[1]).all() else np.zeros((2, 2), np.int64)
    else:
        first, last = (np.floor(np.asarray(corner) * scale + 0.5).astype(int) for corner in window)
    heights = np.full(tuple(last - first + 1), np.nan, np.float32)
    _raise_cells(points, first[0], first[1], scale, heights)
    if dilate_holes:
        heights = _dilate_holes(heights)
    return HeightMap(heights, first / cells_per_m, cells_per_m)


def lattice_index(height_map: HeightMap) -> I64:
    """(2,) the origin of a map on the lattice of whole multiples of its cell size."""
    return np.rint(height_map.origin * height_map.cells_per_m).astype(np.int64)


@njit(cache=True, nogil=True, error_model="numpy")
def _cell_extent(points: F32, cells_per_m: np.float32) -> I64:
    """(2, 2) lowest and highest cell index of finite points; reversed without any."""
    half = np.float32(0.5)
    extent = np.array([[2**40, 2**40], [-(2**40), -(2**40)]])
    for i in range(points.shape[0]):
        finite = np.isfinite(points[i, 0]) and np.isfinite(points[i, 1])
        if not (finite and np.isfinite(points[i, 2])):
            continue
        for axis in range(2):
            index = int(np.floor(points[i, axis] * cells_per_m + half))
            extent[0, axis] = min(extent[0, axis], index)
            extent[1, axis] = max(extent[1, axis], index)
    return extent


@njit(cache=True, nogil=True, error_model="numpy")
def _raise_cells(
    points: F32, first_x: int, first_y: int, cells_per_m: np.float32, heights: F32
) -> None:
    half = np.float32(0.5)
    for i in range(points.shape[0]):
        x, y, z = points[i, 0], points[i, 1], points[i, 2]
        if not (np.isfinite(x) and np.isfinite(y) and np.isfinite(z)):
            continue
        ix = int(np.floor(x * cells_per_m + half)) - first_x
        iy = int(np.floor(y * cells_per_m + half)) - first_y
        inside = 0 <= ix < heights.shape[0] and 0 <= iy < heights.shape[1]
        if inside and not z <= heights[ix, iy]:
            heights[ix, iy] = z


@njit(cache=True, nogil=True, error_model="numpy")
def _dilate_holes(heights: F32) -> F32:
    nx, ny = heights.shape
    filled = heights.copy()
    for ix in range(nx):
        for iy in range(ny):
            if not np.isnan(heights[ix, iy]):
                continue
            highest = np.float32(np.nan)
            for jx in range(max(ix - 1, 0), min(ix + 2, nx)):
                for jy in range(max(iy - 1, 0), min(iy + 2, ny)):
                    if not heights[jx, jy] <= highest and not np.isnan(heights[jx, jy]):
                        highest = heights[jx, jy]
            filled[ix, iy] = highest
    return filled

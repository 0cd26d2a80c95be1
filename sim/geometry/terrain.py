"""Natural ground: an uneven height field on a regular grid, split into triangles."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from airground.core.arrays import read_only
from sim.geometry.noise import smooth_noise
from sim.geometry.surface import Mesh

CELL_M = 0.04
# Wavelength [m] and share of the relief: hills, hummocks, tufts, clods.
_WAVES = ((4.0, 1.0), (1.6, 0.45), (0.6, 0.14), (0.24, 0.05))
CLOD_CELL_M = 0.025
"""Cell of ground with clods: four to a clod [m]."""
_CLODS_M = (0.16, 0.1)
"""Wavelengths of clods, as of ground that was dug or trodden [m]."""


@dataclass(frozen=True, eq=False)
class HeightField:
    """Heights on a square grid over the whole floor, centred on the origin.

    Attributes:
        heights: (NX, NY) float64 [m], x first; split into triangles along the diagonal
            from (i, j) to (i + 1, j + 1).
        size_m: (2,) extent along x and y [m].
    """

    heights: NDArray[np.float64]
    size_m: NDArray[np.float64]

    def __post_init__(self) -> None:
        object.__setattr__(
            self, "heights", read_only(self.heights, "heights", (None, None), np.float64)
        )
        object.__setattr__(self, "size_m", read_only(self.size_m, "size_m", (2,), np.float64))

    def at(self, x: ArrayLike, y: ArrayLike) -> NDArray[np.float64]:
        """Height of the triangles [m]; NaN outside the field."""
        x, y = np.broadcast_arrays(np.asarray(x, float), np.asarray(y, float))
        cells = np.array(self.heights.shape) - 1
        u = (x / self.size_m[0] + 0.5) * cells[0]
        v = (y / self.size_m[1] + 0.5) * cells[1]
        outside = ~((u >= 0) & (u <= cells[0]) & (v >= 0) & (v <= cells[1]))
        i = np.clip(np.nan_to_num(np.floor(u)), 0, cells[0] - 1).astype(int)
        j = np.clip(np.nan_to_num(np.floor(v)), 0, cells[1] - 1).astype(int)
        a, b = u - i, v - j
        h = self.heights
        low, high = h[i, j], h[i + 1, j + 1]
        below = low + a * (h[i + 1, j] - low) + b * (high - h[i + 1, j])
        above = low + b * (h[i, j + 1] - low) + a * (high - h[i, j + 1])
        return np.where(outside, np.nan, np.where(a >= b, below, above))

    def mesh(self) -> Mesh:
        """Two triangles a cell, facing up."""
        nx, ny = self.heights.shape
        x = (np.arange(nx) / (nx - 1) - 0.5) * self.size_m[0]
        y = (np.arange(ny) / (ny - 1) - 0.5) * self.size_m[1]
        vertices = np.stack([*np.meshgrid(x, y, indexing="ij"), self.heights], axis=-1)
        return vertices.reshape(-1, 3), _grid_triangles(nx, ny)

    def picture_coordinates(self) -> NDArray[np.float64]:
        """(V, 2) of the mesh's vertices, 0 to 1: along x, and along y downward as in pictures."""
        nx, ny = self.heights.shape
        u, v = np.meshgrid(np.linspace(0, 1, nx), np.linspace(1, 0, ny), indexing="ij")
        return np.stack([u, v], axis=-1).reshape(-1, 2)

    def normals(self, x: NDArray, y: NDArray) -> NDArray[np.float64]:
        """(N, 3) unit normals of the smoothed ground at x, y (N,)."""
        step = self.size_m[0] / (self.heights.shape[0] - 1)
        half = self.size_m / 2 - 1e-9
        left, right = np.clip(x - step, -half[0], half[0]), np.clip(x + step, -half[0], half[0])
        low, high = np.clip(y - step, -half[1], half[1]), np.clip(y + step, -half[1], half[1])
        slope_x = (self.at(right, y) - self.at(left, y)) / (right - left)
        slope_y = (self.at(x, high) - self.at(x, low)) / (high - low)
        normals = np.stack([-slope_x, -slope_y, np.ones_like(slope_x)], axis=1)
        return normals / np.linalg.norm(normals, axis=1, keepdims=True)


def make_terrain(
    size_m: tuple[float, float], relief_m: float, clods_m: float, rng: np.random.Generator
) -> HeightField:
    """Ground whose highest and lowest points lie `relief_m` apart; the origin is at z = 0.

    `clods_m` is twice the standard deviation of clods on top of that.
    """
    cell_m = CLOD_CELL_M if clods_m > 0 else CELL_M
    nodes = (_odd(size_m[0] / cell_m), _odd(size_m[1] / cell_m))
    heights = np.zeros(nodes)
    for wavelength, share in _WAVES:
        heights += share * smooth_noise(nodes, wavelength / cell_m / 2, rng)
    heights *= relief_m / np.ptp(heights)
    if clods_m > 0:
        clods = sum(smooth_noise(nodes, wavelength / cell_m / 2, rng) for wavelength in _CLODS_M)
        heights += clods * (clods_m / 2 / np.std(clods))
    heights -= heights[nodes[0] // 2, nodes[1] // 2]
    return HeightField(heights, np.array(size_m))


def _odd(cells: float) -> int:
    """Number of nodes for about so many cells, with a node in the middle."""
    return round(cells / 2) * 2 + 1


def _grid_triangles(nx: int, ny: int) -> NDArray[np.int64]:
    corner = (np.arange(nx - 1)[:, None] * ny + np.arange(ny - 1)[None]).ravel()
    lower = np.stack([corner, corner + ny, corner + ny + 1], axis=1)
    upper = np.stack([corner, corner + ny + 1, corner + 1], axis=1)
    return np.concatenate([lower, upper])

"""Points averaged over small cubes: a map that grows with the space seen, not with time."""

from __future__ import annotations

import numpy as np

from airground.core.arrays import I64, U8, Floats
from airground.core.cloud import PointCloud

_BITS = 21
_HALF = 1 << (_BITS - 1)


class VoxelMap:
    """A running mean of position and colour in every cube of side `voxel_m` that holds points.
    The highest of many noisy points is too high, hence the mean before any maximum."""

    def __init__(self, voxel_m: float) -> None:
        self.voxel_m = voxel_m
        self._keys = np.zeros(0, np.int64)
        # Columns: count, then sums of x, y, z, r, g, b.
        self._sums = np.zeros((0, 7))

    def __len__(self) -> int:
        return len(self._keys)

    def add(self, points: Floats, colours: U8) -> None:
        """Add points (N, 3) [m] with colours (N, 3).

        Raises:
            ValueError: A point lies outside the 2^21 cubes a side that a key can hold.
        """
        if len(points) == 0:
            return
        keys, inverse = np.unique(self._key(points), return_inverse=True)
        columns = [np.ones(len(points)), *points.T, *colours.T]
        sums = np.stack([np.bincount(inverse, column, len(keys)) for column in columns], axis=1)
        at = np.searchsorted(self._keys, keys)
        known = np.zeros(len(keys), bool)
        inside = at < len(self._keys)
        known[inside] = self._keys[at[inside]] == keys[inside]
        self._sums[at[known]] += sums[known]
        self._keys = np.insert(self._keys, at[~known], keys[~known])
        self._sums = np.insert(self._sums, at[~known], sums[~known], axis=0)

    def cloud(self) -> PointCloud:
        """One point per cube, with the mean position and colour."""
        mean = self._sums[:, 1:] / self._sums[:, :1]
        return PointCloud(
            mean[:, :3].astype(np.float32), np.rint(mean[:, 3:]).clip(0, 255).astype(np.uint8)
        )

    def _key(self, points: Floats) -> I64:
        cell = np.floor(np.asarray(points, np.float64) / self.voxel_m).astype(np.int64) + _HALF
        if (cell < 0).any() or (cell >= 2 * _HALF).any():
            raise ValueError(f"a point lies more than {_HALF * self.voxel_m:.0f} m from the origin")
        return (cell[:, 0] << (2 * _BITS)) | (cell[:, 1] << _BITS) | cell[:, 2]

"""Points averaged over small cubes: a map that grows with the space seen, not with time."""

from __future__ import annotations

import numpy as np

from airground.core.arrays import F64, I64, U8, Floats
from airground.core.cloud import PointCloud

_BITS = 21
_HALF = 1 << (_BITS - 1)


class VoxelMap:
    """A running weighted mean of position and colour in every cube that holds points.

    Averaging before anything takes a maximum matters: the highest of many noisy points is
    too high by a few of their standard deviations.

    Args:
        voxel_m: Side of the cubes [m].
    """

    def __init__(self, voxel_m: float) -> None:
        self.voxel_m = voxel_m
        self._keys = np.zeros(0, np.int64)
        # Columns: count, weight, then weight times x, y, z, r, g, b.
        self._sums = np.zeros((0, 8))

    def __len__(self) -> int:
        return len(self._keys)

    def add(self, points: Floats, colours: U8, weights: Floats | None = None) -> None:
        """Take in points (N, 3) [m], colours (N, 3) and weights (N,), 1 each by default.

        Raises:
            ValueError: A point lies outside the 2^21 cubes a side that a key can hold.
        """
        if len(points) == 0:
            return
        keys, inverse = np.unique(self._key(points), return_inverse=True)
        sums = _sums(inverse, len(keys), points, colours, weights)
        at = np.searchsorted(self._keys, keys)
        known = np.zeros(len(keys), bool)
        inside = at < len(self._keys)
        known[inside] = self._keys[at[inside]] == keys[inside]
        self._sums[at[known]] += sums[known]
        self._keys = np.insert(self._keys, at[~known], keys[~known])
        self._sums = np.insert(self._sums, at[~known], sums[~known], axis=0)

    def cloud(self, min_count: int = 1) -> PointCloud:
        """One point a cube, of the cubes that hold at least `min_count` points."""
        sums = self._sums[self._sums[:, 0] >= min_count]
        mean = sums[:, 2:] / sums[:, 1:2]
        return PointCloud(
            mean[:, :3].astype(np.float32), np.rint(mean[:, 3:]).clip(0, 255).astype(np.uint8)
        )

    def _key(self, points: Floats) -> I64:
        cell = np.floor(np.asarray(points, np.float64) / self.voxel_m).astype(np.int64) + _HALF
        if (cell < 0).any() or (cell >= 2 * _HALF).any():
            raise ValueError(f"a point lies more than {_HALF * self.voxel_m:.0f} m from the origin")
        return (cell[:, 0] << (2 * _BITS)) | (cell[:, 1] << _BITS) | cell[:, 2]


def _sums(inverse: I64, n: int, points: Floats, colours: U8, weights: Floats | None) -> F64:
    weight = np.ones(len(points)) if weights is None else np.asarray(weights, np.float64)
    columns = [np.ones(len(points)), weight]
    columns += [weight * points[:, i] for i in range(3)]
    columns += [weight * colours[:, i] for i in range(3)]
    return np.stack([np.bincount(inverse, column, n) for column in columns], axis=1)

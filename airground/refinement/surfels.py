"""Clouds for ICP: thinned evenly, each point with the plane around it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import small_gicp
from numba import get_num_threads

from airground.core.arrays import F32, F64, I64

NEIGHBOURS = 10


@dataclass(frozen=True, eq=False)
class Surfels:
    """(N, 3) float64 points [m] with unit normals, z up, and their nearest-neighbour tree.
    A normal is zero where the plane is unknown."""

    points: F64
    normals: F64
    tree: small_gicp.KdTree

    def __len__(self) -> int:
        return len(self.points)

    def nearest(self, points: F64) -> tuple[I64, F64]:
        """(N,) index of the nearest point, and (N,) squared distance to it [m^2]."""
        index, squared = self.tree.batch_nearest_neighbor_search(
            points, num_threads=get_num_threads()
        )
        return np.asarray(index, np.int64), np.asarray(squared)


def make_surfels(points: F32, voxel_m: float) -> Surfels:
    """Average points (N >= 1, 3) [m] over cubes and fit a plane to each one's neighbours."""
    # One thread where the result would depend on how many there are.
    cloud = small_gicp.voxelgrid_sampling(np.asarray(points, np.float64), voxel_m, num_threads=1)
    tree = small_gicp.KdTree(cloud, num_threads=1)
    threads = get_num_threads()
    small_gicp.estimate_normals(cloud, tree, num_neighbors=NEIGHBOURS, num_threads=threads)
    normals = np.array(cloud.normals()[:, :3])
    normals[normals[:, 2] < 0] *= -1
    return Surfels(np.array(cloud.points()[:, :3]), normals, tree)

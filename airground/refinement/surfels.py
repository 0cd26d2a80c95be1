"""Clouds for ICP: thinned evenly, each point with the plane around it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import small_gicp
from numba import get_num_threads

from airground.core.arrays import F32, F64, I64

NEIGHBOURS = 10


@dataclass(frozen=True, eq=False)
class Surfels:
    """(N, 3) float64 points [m], with their nearest-neighbour tree and the cloud in it."""

    points: F64
    tree: small_gicp.KdTree
    cloud: small_gicp.PointCloud

    def __len__(self) -> int:
        return len(self.points)

    @cached_property
    def normals(self) -> F64:
        """(N, 3) unit normals, z up; zero where the plane is unknown."""
        threads = get_num_threads()
        small_gicp.estimate_normals(
            self.cloud, self.tree, num_neighbors=NEIGHBOURS, num_threads=threads
        )
        normals = np.array(self.cloud.normals()[:, :3])
        normals[normals[:, 2] < 0] *= -1
        return normals

    def nearest(self, points: F64) -> tuple[I64, F64]:
        """(N,) index of the nearest point, and (N,) squared distance to it [m^2]."""
        index, squared = self.tree.batch_nearest_neighbor_search(
            points, num_threads=get_num_threads()
        )
        return np.asarray(index, np.int64), np.asarray(squared)

    def neighbours(self, points: F64, count: int) -> tuple[I64, F64]:
        """(N, count) indices of the nearest points, the nearest first, and (N, count) squared
        distances to them [m^2]; there must be as many points."""
        index, squared = self.tree.batch_knn_search(points, count, num_threads=get_num_threads())
        return np.asarray(index, np.int64), np.asarray(squared)


def make_surfels(points: F32, voxel_m: float) -> Surfels:
    """Average points (N >= 1, 3) [m] over cubes."""
    # One thread where the result would depend on how many there are.
    cloud = small_gicp.voxelgrid_sampling(np.asarray(points, np.float64), voxel_m, num_threads=1)
    tree = small_gicp.KdTree(cloud, num_threads=1)
    return Surfels(np.array(cloud.points()[:, :3]), tree, cloud)

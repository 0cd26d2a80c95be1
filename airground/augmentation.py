"""The augmented map: what the ground robot saw, extended by what the MAV saw (Fig. 5, 15)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from airground.core.arrays import U8, freeze
from airground.core.cloud import PointCloud, Source
from airground.core.se3 import SE3
from airground.core.surface import AerialSurface
from airground.core.voxel_map import VoxelMap


@dataclass(frozen=True, eq=False)
class AugmentedMap:
    """One cloud in the frame `ground`, and (N,) uint8 `sources`: the robot that saw each point."""

    cloud_ground: PointCloud
    sources: U8

    def __post_init__(self) -> None:
        freeze(self, "sources", (len(self.cloud_ground),), np.uint8)


class Augmentation:
    """Gathers the aerial surfaces that were aligned, averaged over cubes of side `voxel_m`.

    They are kept in the MAV's own map and moved to `ground` by the newest alignment, so
    that a better alignment improves what was added before."""

    def __init__(self, voxel_m: float) -> None:
        self._voxels = VoxelMap(voxel_m)
        self._T_ground_mav: SE3 | None = None

    def add(self, surface: AerialSurface, T_ground_mav: SE3) -> None:
        """Take in a surface and the alignment that was found for it."""
        self._voxels.add(surface.cloud_mav.points, surface.cloud_mav.colours)
        self._T_ground_mav = T_ground_mav

    def map(self, ground: PointCloud) -> AugmentedMap:
        """The ground robot's cloud (in `ground`) with all that was added so far."""
        if self._T_ground_mav is None:
            return AugmentedMap(ground, np.full(len(ground), Source.GROUND, np.uint8))
        aerial = self._voxels.cloud()
        points = np.concatenate([ground.points, self._T_ground_mav @ aerial.points])
        sources = np.repeat([Source.GROUND, Source.MAV], [len(ground), len(aerial)])
        cloud = PointCloud(
            points.astype(np.float32), np.concatenate([ground.colours, aerial.colours])
        )
        return AugmentedMap(cloud, sources.astype(np.uint8))

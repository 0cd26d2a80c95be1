"""A truncated signed distance field in cubic blocks, as Open3D's voxel block grid holds it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import open3d as o3d

from airground.core.arrays import F32, I32

ATTRIBUTES = ("tsdf", "weight", "color")
"""What a voxel holds, as Open3D calls it."""
BLOCK = 8
"""Voxels along each side of a block."""
COLOUR_SCALE = 255.0
"""Open3D keeps colours given as float32 so many times larger."""


def empty_grid(voxel_m: float, blocks: int) -> o3d.t.geometry.VoxelBlockGrid:
    """A grid of voxels of side `voxel_m` [m], with room for that many blocks at first."""
    return o3d.t.geometry.VoxelBlockGrid(
        attr_names=ATTRIBUTES,
        attr_dtypes=(o3d.core.float32,) * 3,
        attr_channels=[o3d.core.SizeVector([n]) for n in (1, 1, 3)],
        voxel_size=voxel_m,
        block_resolution=BLOCK,
        block_count=blocks,
    )


@dataclass(frozen=True, eq=False)
class BlockedField:
    """A truncated signed distance field in blocks; arrays are used as they are, not copied.

    Attributes:
        places: (N, 3) int32 x, y, z of each block [blocks].
        rows: (N,) int32 row of each block in the arrays below.
        tsdf: (C, 8, 8, 8) float32 signed distance by z, y, x; positive before the surface.
        weight: (C, 8, 8, 8) float32 number of keyframes in each voxel.
        colour: (C, 8, 8, 8, 3) float32 mean colour times `COLOUR_SCALE`.
        voxel_m: Side of a voxel [m].
    """

    places: I32
    rows: I32
    tsdf: F32
    weight: F32
    colour: F32
    voxel_m: float

    @classmethod
    def of(cls, grid: o3d.t.geometry.VoxelBlockGrid, voxel_m: float) -> BlockedField:
        """What a grid with attributes tsdf, weight and color holds now; no copy."""
        rows = grid.hashmap().active_buf_indices().numpy()
        tsdf, weight, colour = (grid.attribute(name).numpy() for name in ATTRIBUTES)
        places = grid.hashmap().key_tensor().numpy()[rows]
        return cls(places, rows.astype(np.int32), tsdf[..., 0], weight[..., 0], colour, voxel_m)

    def copy(self) -> BlockedField:
        """A copy in memory of its own, which does not change any more."""
        tsdf, weight, colour = (
            values[self.rows] for values in (self.tsdf, self.weight, self.colour)
        )
        rows = np.arange(len(self.rows), dtype=np.int32)
        return BlockedField(self.places.copy(), rows, tsdf, weight, colour, self.voxel_m)

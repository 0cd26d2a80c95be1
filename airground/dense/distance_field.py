"""Depth maps as distance fields, gathered in a histogram at every voxel (Sec. V).

A depth map gives a voxel the value f = (depth seen there - depth of the voxel) / truncation,
cut to [-1, 1]: positive before the surface, negative behind it. A voxel farther behind the
surface than the truncation gets no vote. Four bits of a 32-bit word count each bin, so that a
histogram has at most 8 bins and takes at most 15 depth maps."""

from __future__ import annotations

import numpy as np
from numba import njit, prange

from airground.core.arrays import F32, FAST, U32
from airground.core.surface import DepthMap
from airground.dense.volume import Volume

MAX_BINS = 8
MAX_DEPTH_MAPS = 15


class FieldHistogram:
    """n(v, j) of Eq. 1: how often each voxel got a value from each bin.

    Attributes:
        truncation_m: Distance at which the field reaches -1 or 1 [m].
        counts: (rows, planes, columns) uint32, bin j in bits 4 j to 4 j + 3.
    """

    def __init__(
        self, volume: Volume, truncation_m: float, bins: int = MAX_BINS, memory: U32 | None = None
    ) -> None:
        if not 2 <= bins <= MAX_BINS:
            raise ValueError(f"a histogram has 2 to {MAX_BINS} bins, got {bins}")
        self.volume = volume
        self.truncation_m = truncation_m
        self.bins = bins
        if memory is None or memory.shape != volume.shape:
            memory = np.empty(volume.shape, np.uint32)
        memory.fill(0)
        self.counts = memory
        self.depth_maps = 0

    def add(self, depth_map: DepthMap) -> None:
        """Adds the distance field of one depth map; ValueError if the four bits are full."""
        if self.depth_maps >= MAX_DEPTH_MAPS:
            raise ValueError(f"a histogram takes at most {MAX_DEPTH_MAPS} depth maps")
        volume, camera = self.volume, depth_map.camera
        T_map_volume = depth_map.T_mav_camera.inverse() @ volume.T_mav_camera
        # homogeneous pixel of the map = z * matrix @ (x, y, 1) + shift
        matrix = camera.matrix() @ T_map_volume.rotation @ np.linalg.inv(volume.camera.matrix())
        shift = camera.matrix() @ T_map_volume.translation
        flat = np.append(depth_map.depth.ravel(), np.float32(np.nan))
        add_field(
            self.counts,
            flat,
            camera.width,
            camera.height,
            matrix.astype(np.float32),
            shift.astype(np.float32),
            volume.depths().astype(np.float32),
            1.0 / self.truncation_m,
            self.bins,
        )
        self.depth_maps += 1


@njit(cache=True, parallel=True, nogil=True, error_model="numpy", fastmath=FAST)
def add_field(
    counts: U32,
    depth: F32,
    width: int,
    height: int,
    matrix: F32,
    shift: F32,
    plane_depths: F32,
    inverse_truncation: float,
    bins: int,
) -> None:
    """Adds one vote at every voxel that the depth map sees, in its nearest pixel.

    Args:
        counts: (rows, planes, columns) uint32, added to.
        depth: (height * width + 1,) float32, row by row, then one NaN for "outside".
        width, height: Size of the depth map [px].
        matrix, shift: (3, 3) and (3,) float32: the voxel [y, k, x] lies at the homogeneous
            pixel z_k matrix (x, y, 1) + shift of the depth map.
        plane_depths: (planes,) float32 depth of each plane [m].
        inverse_truncation: Inverse of the truncation distance [1/m].
        bins: Number of bins.
    """
    rows, planes, columns = counts.shape
    # one stray 64-bit operand would widen whole loops
    outside, stride = np.int32(width * height), np.int32(width)
    right, bottom = np.float32(width), np.float32(height)
    zero, half, one = np.float32(0.0), np.float32(0.5), np.float32(1.0)
    per_metre, levels = np.float32(inverse_truncation), np.float32(0.5 * bins)
    for y in prange(rows):
        index = np.empty(columns, np.int32)
        z = np.empty(columns, np.float32)
        seen = np.empty(columns, np.float32)
        base0 = matrix[0, 1] * np.float32(y) + matrix[0, 2]
        base1 = matrix[1, 1] * np.float32(y) + matrix[1, 2]
        base2 = matrix[2, 1] * np.float32(y) + matrix[2, 2]
        for k in range(planes):
            plane = plane_depths[k]
            for x in range(columns):
                column = np.float32(x)
                w = plane * (matrix[2, 0] * column + base2) + shift[2]
                inverse = one / w
                u = (plane * (matrix[0, 0] * column + base0) + shift[0]) * inverse + half
                v = (plane * (matrix[1, 0] * column + base1) + shift[1]) * inverse + half
                z[x] = w
                inside = (w > zero) & (u >= zero) & (u < right) & (v >= zero) & (v < bottom)
                iu = np.int32(u if inside else zero)
                iv = np.int32(v if inside else zero)
                index[x] = np.int32(iv * stride + iu) if inside else outside
            for x in range(columns):
                seen[x] = depth[index[x]]
            row = counts[y, k]
            for x in range(columns):
                value = (seen[x] - z[x]) * per_metre
                visible = value >= -one
                level = (min(value, np.float32(0.999)) + one) * levels
                bin_index = np.int32(level) if visible else np.int32(-1)
                vote = np.uint32(0)
                for j in range(MAX_BINS):
                    vote = np.uint32(1 << (4 * j)) if bin_index == j else vote
                row[x] = np.uint32(row[x] + vote)

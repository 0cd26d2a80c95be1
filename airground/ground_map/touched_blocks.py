"""Blocks of a distance field that a depth image measures (Sec. IV).

They equal those of Open3D's `compute_unique_block_coordinates`. A box of marks around the view
replaces its hash set."""

from __future__ import annotations

import numpy as np
from numba import njit

from airground.core.arrays import F32, I32
from airground.core.camera import PinholeCamera
from airground.core.se3 import SE3

STRIDE = 4
"""Step between the pixels that are read, along both axes [px]."""
STEPS = 3
"""Steps along a ray from the near to the far end of the truncated field."""


def touched_blocks(
    depth: F32,
    camera: PinholeCamera,
    T_map_camera: SE3,
    block_m: float,
    truncation_m: float,
    max_depth_m: float,
) -> I32:
    """Blocks that a truncated signed distance field needs for a view.

    Args:
        depth: (height, width) depth [m], 0 where missing.
        camera: Camera of the image.
        T_map_camera: Pose of the camera in the map.
        block_m: Side of a block [m].
        truncation_m: Distance from the surface at which the field ends [m].
        max_depth_m: Depth from which on nothing is used [m].

    Returns:
        (N, 3) x, y, z of each block in the frame `map` [blocks], each once, by x, then y, then z.
    """
    inverse = np.array([1 / camera.fx, 1 / camera.fy, camera.cx, camera.cy], np.float32)
    blocks, count = blocks_along_rays(
        depth,
        inverse,
        T_map_camera.matrix()[:3].astype(np.float32),
        np.float32(block_m),
        np.float32(truncation_m),
        np.float32(max_depth_m),
    )
    return unique_blocks(blocks[:count])


@njit(cache=True, nogil=True, error_model="numpy")
def blocks_along_rays(
    depth: F32,
    inverse: F32,
    T_map_camera: F32,
    block_m: np.float32,
    truncation_m: np.float32,
    max_depth_m: np.float32,
) -> tuple[I32, int]:
    """Room for blocks (M, 3) on both sides of what each pixel measured, and their number.

    Arguments are as of `touched_blocks`; `inverse` (4,) holds 1 / fx, 1 / fy, cx, cy, and
    `T_map_camera` (3, 4) the upper rows of the pose."""
    rows, columns = depth.shape[0] // STRIDE, depth.shape[1] // STRIDE
    blocks = np.empty((rows * columns * (STEPS + 1), 3), np.int32)
    r00, r01, r02, x0 = T_map_camera[0]
    r10, r11, r12, y0 = T_map_camera[1]
    r20, r21, r22, z0 = T_map_camera[2]
    nothing = np.float32(0.0)
    count = 0
    for v in range(0, rows * STRIDE, STRIDE):
        down = (np.float32(v) - inverse[3]) * inverse[1]
        for u in range(0, columns * STRIDE, STRIDE):
            measured = depth[v, u]
            if not (measured > 0 and measured < max_depth_m):
                continue
            right = (np.float32(u) - inverse[2]) * inverse[0]
            along_x = r00 * right + r01 * down + r02
            along_y = r10 * right + r11 * down + r12
            along_z = r20 * right + r21 * down + r22
            near = max(measured - truncation_m, nothing)
            far = min(measured + truncation_m, max_depth_m)
            step = (far - near) / np.float32(STEPS)
            at = near
            for _ in range(STEPS + 1):
                blocks[count, 0] = np.floor((x0 + at * along_x) / block_m)
                blocks[count, 1] = np.floor((y0 + at * along_y) / block_m)
                blocks[count, 2] = np.floor((z0 + at * along_z) / block_m)
                count += 1
                at += step
    return blocks, count


@njit(cache=True, nogil=True)
def unique_blocks(blocks: I32) -> I32:
    """(N, 3) of (M, 3): each once, sorted, as `np.unique` along the first axis."""
    if len(blocks) == 0:
        return np.empty((0, 3), np.int32)
    low, high = blocks[0].copy(), blocks[0].copy()
    for block in blocks:
        for axis in range(3):
            low[axis] = min(low[axis], block[axis])
            high[axis] = max(high[axis], block[axis])
    sides = high - low + 1
    marks = np.zeros((sides[0], sides[1], sides[2]), np.bool_)
    for block in blocks:
        marks[block[0] - low[0], block[1] - low[1], block[2] - low[2]] = True
    unique = np.empty((np.count_nonzero(marks), 3), np.int32)
    count = 0
    for x in range(sides[0]):
        for y in range(sides[1]):
            for z in range(sides[2]):
                if marks[x, y, z]:
                    unique[count, 0] = low[0] + x
                    unique[count, 1] = low[1] + y
                    unique[count, 2] = low[2] + z
                    count += 1
    return unique

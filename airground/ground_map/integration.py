"""A depth image into the distance field of the ground map (Sec. IV).

A voxel holds its mean truncated signed distance (Curless and Levoy, SIGGRAPH 1996). It reads the
pixel that it falls on. Open3D's integration rounds down, half a pixel off in the mean: a floor
seen at a shallow angle then lies too low."""

from __future__ import annotations

import numpy as np
import open3d as o3d
from numba import njit, prange

from airground.core.arrays import F32, I32, U8
from airground.core.camera import PinholeCamera
from airground.core.se3 import SE3
from airground.ground_map.blocked_field import ATTRIBUTES, BLOCK, COLOUR_SCALE

ONE, HALF, SCALE = np.float32(1.0), np.float32(0.5), np.float32(COLOUR_SCALE)


def integrate(
    grid: o3d.t.geometry.VoxelBlockGrid,
    blocks: I32,
    depth: F32,
    colour: U8,
    camera: PinholeCamera,
    T_map_camera: SE3,
    voxel_m: float,
    truncation_m: float,
) -> None:
    """Add one view to a field in the frame `map`, in the blocks that it touches.

    Args:
        grid: Grid with the attributes of `BlockedField`; changed.
        blocks: (N, 3) places of the blocks [blocks]; missing ones are created.
        depth: (height, width) depth [m], 0 where missing.
        colour: (height, width, 3) RGB image.
        camera: Camera of both images.
        T_map_camera: Pose of the camera in the map.
        voxel_m: Side of a voxel [m].
        truncation_m: Distance from the surface at which the field ends [m].
    """
    if len(blocks) == 0:
        return
    places = o3d.core.Tensor.from_numpy(blocks)
    grid.hashmap().activate(places)
    rows, _ = grid.hashmap().find(places)
    tsdf, weight, colours = (grid.attribute(name).numpy() for name in ATTRIBUTES)
    T_camera_map = T_map_camera.inverse()
    add_view(
        blocks,
        rows.numpy(),
        depth,
        colour,
        np.array([camera.fx, camera.fy, camera.cx, camera.cy], np.float32),
        T_camera_map.matrix()[:3].astype(np.float32),
        np.float32(voxel_m),
        np.float32(truncation_m),
        (tsdf[..., 0], weight[..., 0], colours),
    )


@njit(cache=True, parallel=True, nogil=True, error_model="numpy")
def add_view(
    places: I32,
    rows: I32,
    depth: F32,
    colour: U8,
    pinhole: F32,
    T_camera_map: F32,
    voxel_m: np.float32,
    truncation_m: np.float32,
    field: tuple[F32, F32, F32],
) -> None:
    """`integrate` on arrays.

    Args:
        places, rows: (N, 3) places of the blocks [blocks] and their (N,) rows in the field.
        depth, colour, voxel_m, truncation_m: As in `integrate`.
        pinhole: (4,) intrinsics fx, fy, cx, cy [px].
        T_camera_map: (3, 4) upper rows of the pose.
        field: Distance, weight and colour of `BlockedField`; changed.
    """
    for block in prange(len(rows)):
        _add_to_block(
            places[block],
            depth,
            colour,
            pinhole,
            T_camera_map,
            voxel_m,
            truncation_m,
            field[0][rows[block]],
            field[1][rows[block]],
            field[2][rows[block]],
        )


@njit(cache=True, nogil=True, error_model="numpy")
def _add_to_block(
    place: I32,
    depth: F32,
    colour: U8,
    pinhole: F32,
    T_camera_map: F32,
    voxel_m: np.float32,
    truncation_m: np.float32,
    tsdf: F32,
    weight: F32,
    colours: F32,
) -> None:
    fx, fy, cx, cy = pinhole
    r00, r01, r02, t0 = T_camera_map[0]
    r10, r11, r12, t1 = T_camera_map[1]
    r20, r21, r22, t2 = T_camera_map[2]
    first_x = place[0] * BLOCK
    line = np.empty((3, BLOCK), np.float32)
    for k in range(BLOCK):
        z = np.float32(place[2] * BLOCK + k) * voxel_m
        for j in range(BLOCK):
            y = np.float32(place[1] * BLOCK + j) * voxel_m
            # Where the voxels of a line fall, without branches, so that it vectorizes.
            column, row, along = line
            for i in range(BLOCK):
                x = np.float32(first_x + i) * voxel_m
                right = r00 * x + r01 * y + r02 * z + t0
                down = r10 * x + r11 * y + r12 * z + t1
                forward = r20 * x + r21 * y + r22 * z + t2
                along[i] = forward
                column[i] = np.floor(fx * right / forward + cx + HALF)
                row[i] = np.floor(fy * down / forward + cy + HALF)
            _add_to_line(line, depth, colour, truncation_m, tsdf[k, j], weight[k, j], colours[k, j])


@njit(cache=True, nogil=True, error_model="numpy")
def _add_to_line(
    line: F32,
    depth: F32,
    colour: U8,
    truncation_m: np.float32,
    tsdf: F32,
    weight: F32,
    colours: F32,
) -> None:
    height, width = np.float32(depth.shape[0]), np.float32(depth.shape[1])
    column, row, along = line
    for i in range(BLOCK):
        before_camera = along[i] > 0
        inside = (column[i] >= 0) & (column[i] < width) & (row[i] >= 0) & (row[i] < height)
        if not (before_camera & inside):
            continue
        v, u = np.uint64(row[i]), np.uint64(column[i])
        distance = depth[v, u] - along[i]
        if depth[v, u] <= 0 or distance < -truncation_m:
            continue
        distance = min(distance / truncation_m, ONE)
        before = weight[i]
        share = ONE / (before + ONE)
        tsdf[i] = (before * tsdf[i] + distance) * share
        for channel in range(3):
            seen = SCALE * np.float32(colour[v, u, channel])
            colours[i, channel] = (before * colours[i, channel] + seen) * share
        weight[i] = before + ONE

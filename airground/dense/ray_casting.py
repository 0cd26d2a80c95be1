"""From the fused field to points: its zero level set seen from the reference view (Sec. V)."""

from __future__ import annotations

import numpy as np
from numba import njit, prange

from airground.core.arrays import F32, F64, FAST, I32, U8, U32
from airground.core.cloud import PointCloud
from airground.core.surface import DepthMap
from airground.dense.distance_field import MAX_BINS
from airground.dense.volume import Volume


def cast_surface(
    volume: Volume,
    phi: F32,
    counts: U32,
    min_observations: int,
    truncation_m: float,
    bins: int = MAX_BINS,
) -> tuple[F32, F32]:
    """Depth and normals of the surface in the volume's own view.

    The votes are bin centres, so that the crossing of phi is known to a voxel only; the zero of the
    line fitted to the voxels within half the truncation is far more exact.

    Args:
        volume: The voxels.
        phi: (rows, planes, columns) float32, the fused field, positive before the surface.
        counts: (rows, planes, columns) uint32, the packed histogram.
        min_observations: Least number of votes for a surface within the truncation of a point.
        truncation_m: Distance at which phi reaches -1 or 1 [m].
        bins: Number of bins of the histogram.

    Returns:
        Depth (rows, columns) float32 [m], NaN where there is no surface, and unit normals
        (rows, columns, 3) float32 in the camera's axes, pointing into free space.
    """
    height, _, width = volume.shape
    depth = np.full((height, width), np.nan, np.float32)
    normals = np.full((height, width, 3), np.nan, np.float32)
    camera = volume.camera
    intrinsics = np.array([camera.fx, camera.fy, camera.cx, camera.cy])
    planes = volume.depths()
    reach = max(1, int(0.5 * truncation_m / (planes[1] - planes[0])))
    scan(phi, counts, planes, intrinsics, min_observations, reach, bins, depth, normals)
    return depth, normals


def surface_cloud(volume: Volume, depth: F32, normals: F32, reference: DepthMap) -> PointCloud:
    """The cast points in the MAV's map, with the grey values of the reference view."""
    camera, T_mav_camera = volume.camera, volume.T_mav_camera
    intrinsics = np.array([camera.fx, camera.fy, camera.cx, camera.cy])
    return PointCloud(
        *_seen_points(
            depth,
            normals,
            reference.image,
            intrinsics,
            T_mav_camera.rotation,
            T_mav_camera.translation,
        )
    )


@njit(cache=True, nogil=True, error_model="numpy")
def _seen_points(
    depth: F32, normals: F32, image: U8, intrinsics: F64, rotation: F64, translation: F64
) -> tuple[F32, U8, F32]:
    """(N, 3) float32 points, (N, 3) uint8 colours and (N, 3) float32 normals, row by row."""
    rows, columns = depth.shape
    fx, fy, cx, cy = intrinsics
    count = np.isfinite(depth).sum()
    points = np.empty((count, 3), np.float32)
    colours = np.empty((count, 3), np.uint8)
    turned = np.empty((count, 3), np.float32)
    at = 0
    for row in range(rows):
        y = (row - cy) / fy
        for column in range(columns):
            z = np.float64(depth[row, column])
            if not np.isfinite(z):
                continue
            x = (column - cx) / fx
            grey = image[row * image.shape[0] // rows, column * image.shape[1] // columns]
            nx, ny, nz = normals[row, column]
            for axis in range(3):
                r0, r1, r2 = rotation[axis]
                points[at, axis] = z * (r0 * x + r1 * y + r2) + translation[axis]
                turned[at, axis] = r0 * nx + r1 * ny + r2 * nz
                colours[at, axis] = grey
            at += 1
    return points, colours, turned


@njit(cache=True, inline="always")
def _sum_of_counts(word: np.uint32) -> np.uint32:
    """Sum of the eight counts of four bits each: first of pairs, then of all four bytes."""
    bytes_ = np.uint32(0x0F0F0F0F)
    pairs = np.uint32(word & bytes_) + np.uint32(np.uint32(word >> np.uint32(4)) & bytes_)
    return np.uint32(np.uint32(np.uint32(pairs) * np.uint32(0x01010101)) >> np.uint32(24))


@njit(cache=True, error_model="numpy")
def _first_hits(
    here: F32,
    behind: F32,
    word_here: U32,
    word_behind: U32,
    near: np.uint32,
    votes: np.uint32,
    k: int,
    hit: I32,
) -> None:
    """Notes in `hit` the plane k where phi first falls below zero between k and k + 1.
    A crossing needs `votes` counts in the bins of the mask `near`. `hit` (columns,) is -1 before.
    """
    zero, plane = np.float32(0), np.int32(k)
    crossings = np.uint32(0)
    for x in range(len(hit)):
        crossings |= np.uint32((here[x] > zero) & (behind[x] <= zero))
    if crossings == 0:
        return
    for x in range(len(hit)):
        most = max(_sum_of_counts(word_here[x] & near), _sum_of_counts(word_behind[x] & near))
        new = (here[x] > zero) & (behind[x] <= zero) & (most >= votes) & (hit[x] < 0)
        hit[x] = plane if new else hit[x]


@njit(cache=True, error_model="numpy")
def _line_zero(column: F32, k: int, reach: int, crossing: float) -> float:
    """Zero of the line fitted to phi `reach` planes around plane k + 1/2, in planes behind k.
    `crossing` where phi is no falling line: near another surface, or at the volume's end."""
    if k + 1 - reach < 0 or k + reach >= len(column):
        return crossing
    total, moment, square = 0.0, 0.0, 0.0
    before = column[k + 1 - reach]
    for i in range(1 - reach, reach + 1):
        value = column[k + i]
        if value > before:
            return crossing
        before = value
        offset = i - 0.5
        total += value
        moment += offset * value
        square += offset * offset
    zero = 0.5 - (total / (2 * reach)) / (moment / square)
    return zero if abs(zero - crossing) <= 1.5 else crossing


@njit(cache=True, parallel=True, nogil=True, error_model="numpy", fastmath=FAST)
def scan(
    phi: F32,
    counts: U32,
    plane_depths: F64,
    intrinsics: F64,
    min_observations: int,
    reach: int,
    bins: int,
    depth: F32,
    normals: F32,
) -> None:
    """Finds in each column the first supported change of phi from positive to negative."""
    rows, planes, columns = phi.shape
    fx, fy, cx, cy = intrinsics
    # Votes in all bins but the last, which says "free".
    near, votes = np.uint32((1 << (4 * (bins - 1))) - 1), np.uint32(max(min_observations, 0))
    for y in prange(rows):
        row = np.int64(y)
        up, down = row - 1 if row > 0 else row, row + 1 if row + 1 < rows else row
        hit = np.full(columns, np.int32(-1), np.int32)
        for k in range(planes - 1):
            _first_hits(
                phi[y, k], phi[y, k + 1], counts[y, k], counts[y, k + 1], near, votes, k, hit
            )
        for x in range(columns):
            if hit[x] < 0:
                continue
            k = int(hit[x])
            here, behind = phi[y, k, x], phi[y, k + 1, x]
            crossing = here / (here - behind)
            fraction = _line_zero(phi[y, :, x], k, reach, crossing)
            z = plane_depths[k] + fraction * (plane_depths[k + 1] - plane_depths[k])
            depth[y, x] = z
            left, right = max(x - 1, 0), min(x + 1, columns - 1)
            closest = k if crossing < 0.5 else k + 1
            k0, k1 = max(k - 1, 0), min(k + 2, planes - 1)
            gx = (phi[y, closest, right] - phi[y, closest, left]) / (right - left)
            gy = (phi[down, closest, x] - phi[up, closest, x]) / (down - up)
            gk = (phi[y, k1, x] - phi[y, k0, x]) / (plane_depths[k1] - plane_depths[k0])
            # x = fx X / Z + cx: a step in Z at fixed X, Y also moves the pixel
            nx, ny = gx * fx / z, gy * fy / z
            nz = gk - gx * (x - cx) / z - gy * (y - cy) / z
            norm = np.sqrt(nx * nx + ny * ny + nz * nz)
            if norm > 0:
                normals[y, x, 0] = nx / norm
                normals[y, x, 1] = ny / norm
                normals[y, x, 2] = nz / norm
            else:
                normals[y, x, 0] = 0.0
                normals[y, x, 1] = 0.0
                normals[y, x, 2] = -1.0

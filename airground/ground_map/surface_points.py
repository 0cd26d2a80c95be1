"""From the fused field to points: where it changes its sign between neighbouring voxels.

Points come in the order of the blocks' places. Open3D's own extraction has another order each
time, and leaves out a surface that runs exactly through voxels."""

from __future__ import annotations

import numpy as np
from numba import njit, prange

from airground.core.arrays import F32, I32, I64, U8
from airground.core.cloud import PointCloud
from airground.ground_map.blocked_field import BLOCK, COLOUR_SCALE, BlockedField

BEFORE, BEHIND = 1, 2
"""What a block's points need of the blocks around: an edge's far end, and its gradient."""
SIDE = BEFORE + BLOCK + BEHIND
LAYER, VOXELS = BLOCK**2, BLOCK**3
_BITS, _BIAS = 21, 1 << 20
"""A block's place is one word of three such fields, each shifted to be positive."""
_X, _Y, _Z = 1, 1 << _BITS, 1 << (2 * _BITS)


def surface_points(field: BlockedField, min_weight: float) -> PointCloud:
    """Points of the zero level with colours and normals, block by block.
    Voxels of a weight up to `min_weight` count as unknown."""
    words = ((field.places.astype(np.int64) + _BIAS) * (_X, _Y, _Z)).sum(axis=1)
    order = np.argsort(words)
    places, rows = field.places[order], field.rows[order]
    beside = neighbours(words[order])
    tsdf, weight = (values.reshape(-1, VOXELS) for values in (field.tsdf, field.weight))
    crossed, counts = find_crossings(tsdf, weight, rows, beside, np.float32(min_weight))
    first = np.concatenate([[0], np.cumsum(counts)])
    points, colours, normals = place_points(
        field.tsdf, field.colour, places, rows, beside, crossed, first
    )
    points *= np.float32(field.voxel_m)
    return PointCloud(points, colours, normals)


@njit(cache=True, parallel=True, nogil=True)
def neighbours(words: I64) -> I32:
    """(N, 27) index of the neighbours of blocks at ascending `words`, -1 where there is none.
    Each block itself is in the middle."""
    table = np.full((len(words), 27), np.int32(-1), np.int32)
    for block in prange(len(words)):
        for line in range(9):
            # Those of one line along x lie side by side.
            word = words[block] + (line // 3 - 1) * _Z + (line % 3 - 1) * _Y - _X
            at = np.searchsorted(words, word)
            for step in range(3):
                if at < len(words) and words[at] == word + step:
                    table[block, 3 * line + step] = at
                    at += 1
    return table


@njit(cache=True)
def _range_of(step: int) -> tuple[int, int, int]:
    """What a cube has of a neighbour along one axis: first and end there, first in the cube."""
    if step < 0:
        return BLOCK - BEFORE, BLOCK, 0
    if step == 0:
        return 0, BLOCK, BEFORE
    return 0, BEHIND, BEFORE + BLOCK


@njit(cache=True)
def _surround(values: F32, rows: I32, near: I32, cube: F32) -> None:
    """A block's voxels in `cube` (11, 11, 11), with those around, NaN where no block is.
    `cube` starts `BEFORE` voxels before the block; `near` are its 27 neighbours."""
    cube[:] = np.nan
    for number in range(27):
        block = near[number]
        if block < 0:
            continue
        z0, z1, z = _range_of(number // 9 - 1)
        y0, y1, y = _range_of(number // 3 % 3 - 1)
        x0, x1, x = _range_of(number % 3 - 1)
        for k in range(z1 - z0):
            for j in range(y1 - y0):
                source, sink = values[rows[block], z0 + k, y0 + j], cube[z + k, y + j]
                for i in range(x1 - x0):
                    sink[x + i] = source[x0 + i]


@njit(cache=True)
def _take_known(tsdf: F32, weight: F32, min_weight: np.float32, out: F32) -> None:
    """Values of voxels (K,), NaN where they are unknown."""
    for i in range(len(out)):
        out[i] = tsdf[i] if weight[i] > min_weight else np.float32(np.nan)


@njit(cache=True)
def _changes_sign(here: np.float32, there: np.float32) -> np.uint8:
    """1 where one is negative and the other is not; a voxel on the surface is no hole in it."""
    return np.uint8(((here < 0) & (there >= 0)) | ((here >= 0) & (there < 0)))


@njit(cache=True, parallel=True, nogil=True)
def find_crossings(
    tsdf: F32, weight: F32, rows: I32, beside: I32, min_weight: np.float32
) -> tuple[U8, I64]:
    """Which edges between known voxels change their sign.

    Args:
        tsdf, weight: (C, 512) arrays of `BlockedField`, flat: x, y, z step by 1, 8, 64.
        rows: (N,) rows of the blocks, as in `BlockedField`.
        beside: (N, 27) the blocks' neighbours.
        min_weight: Weight up to which a voxel counts as unknown.

    Returns:
        (N, 512) bits 1, 2, 4 of a voxel for its edges along x, y, z, and (N,) their number.
    """
    crossed = np.empty((len(rows), VOXELS), np.uint8)
    counts = np.zeros(len(rows), np.int64)
    for block in prange(len(rows)):
        # A layer of the block behind along z follows the block's own.
        here = np.full(VOXELS + LAYER, np.float32(np.nan), np.float32)
        ahead_x, ahead_y = np.empty(VOXELS, np.float32), np.empty(VOXELS, np.float32)
        behind_x, behind_y, behind_z = beside[block, 14], beside[block, 16], beside[block, 22]
        _take_known(tsdf[rows[block]], weight[rows[block]], min_weight, here[:VOXELS])
        if behind_z >= 0:
            row = rows[behind_z]
            _take_known(tsdf[row], weight[row], min_weight, here[VOXELS:])
        ahead_x[: VOXELS - 1], ahead_y[: VOXELS - BLOCK] = here[1:VOXELS], here[BLOCK:VOXELS]
        for i in range(BLOCK):
            for j in range(BLOCK):
                last, first = LAYER * i + BLOCK * j + BLOCK - 1, LAYER * i + BLOCK * j
                row = rows[behind_x]
                known = behind_x >= 0 and weight[row, first] > min_weight
                ahead_x[last] = tsdf[row, first] if known else np.float32(np.nan)
                last, first = LAYER * i + BLOCK * (BLOCK - 1) + j, LAYER * i + j
                row = rows[behind_y]
                known = behind_y >= 0 and weight[row, first] > min_weight
                ahead_y[last] = tsdf[row, first] if known else np.float32(np.nan)
        bits, found = crossed[block], 0
        for i in range(VOXELS):
            along_x = _changes_sign(here[i], ahead_x[i])
            along_y = _changes_sign(here[i], ahead_y[i])
            along_z = _changes_sign(here[i], here[i + LAYER])
            bits[i] = along_x + 2 * along_y + 4 * along_z
            found += int(along_x) + int(along_y) + int(along_z)
        counts[block] = found
    return crossed, counts


@njit(cache=True)
def _difference(cube: F32, x: int, y: int, z: int, axis: int) -> np.float32:
    """Central difference of the field at a voxel, 0 where a side is in no block."""
    i, j, k = int(axis == 0), int(axis == 1), int(axis == 2)
    value = cube[z + k, y + j, x + i] - cube[z - k, y - j, x - i]
    return value if value == value else np.float32(0)


@njit(cache=True, error_model="numpy")
def _crossing(
    cube: F32, x: int, y: int, z: int, axis: int
) -> tuple[np.float32, tuple[np.float32, np.float32, np.float32]]:
    """Place from 0 to 1 on the edge x, y, z, `axis` in `cube` where it crosses the zero level, and
    the unit normal there, towards free space; both linear along the edge."""
    i, j, k = x + (axis == 0), y + (axis == 1), z + (axis == 2)
    share = cube[z, y, x] / (cube[z, y, x] - cube[k, j, i])
    rest = np.float32(1) - share
    nx = rest * _difference(cube, x, y, z, 0) + share * _difference(cube, i, j, k, 0)
    ny = rest * _difference(cube, x, y, z, 1) + share * _difference(cube, i, j, k, 1)
    nz = rest * _difference(cube, x, y, z, 2) + share * _difference(cube, i, j, k, 2)
    length = np.sqrt(nx * nx + ny * ny + nz * nz) + np.float32(1e-5)
    return share, (nx / length, ny / length, nz / length)


@njit(cache=True, parallel=True, nogil=True, error_model="numpy")
def place_points(
    tsdf: F32, colour: F32, places: I32, rows: I32, beside: I32, crossed: U8, first: I64
) -> tuple[F32, U8, F32]:
    """The points (M, 3) float32 [voxels], colours (M, 3) uint8, unit normals (M, 3) float32.

    Args:
        tsdf, colour, places, rows: Arrays of `BlockedField`, the last two in the order of words.
        beside: (N, 27) the blocks' neighbours.
        crossed: (N, 512) bits from `find_crossings`.
        first: (N + 1,) index of each block's first point.
    """
    points = np.empty((first[-1], 3), np.float32)
    colours = np.empty((first[-1], 3), np.uint8)
    normals = np.empty((first[-1], 3), np.float32)
    scale = np.float32(1 / COLOUR_SCALE)
    for block in prange(len(rows)):
        at = first[block]
        if at == first[block + 1]:
            continue
        near, here = beside[block], rows[block]
        cube = np.empty((SIDE, SIDE, SIDE), np.float32)
        _surround(tsdf, rows, near, cube)
        for voxel in range(VOXELS):
            if crossed[block, voxel] == 0:
                continue
            z, y, x = voxel // LAYER, voxel // BLOCK % BLOCK, voxel % BLOCK
            for axis in range(3):
                if not crossed[block, voxel] & (1 << axis):
                    continue
                share, normal = _crossing(cube, x + BEFORE, y + BEFORE, z + BEFORE, axis)
                points[at, 0] = BLOCK * places[block, 0] + x
                points[at, 1] = BLOCK * places[block, 1] + y
                points[at, 2] = BLOCK * places[block, 2] + z
                points[at, axis] += share
                normals[at, 0], normals[at, 1], normals[at, 2] = normal
                i, j, k = x + (axis == 0), y + (axis == 1), z + (axis == 2)
                there = rows[near[9 * (k // BLOCK + 1) + 3 * (j // BLOCK + 1) + i // BLOCK + 1]]
                i, j, k = i % BLOCK, j % BLOCK, k % BLOCK
                for channel in range(3):
                    mixed = (np.float32(1) - share) * colour[here, z, y, x, channel]
                    mixed += share * colour[there, k, j, i, channel]
                    colours[at, channel] = np.uint8(np.rint(mixed * scale))
                at += 1
    return points, colours, normals

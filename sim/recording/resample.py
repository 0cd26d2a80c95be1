"""Pictures and depth of a tile, taken from the pinhole view that was drawn of it.

What a pixel sees is what its own ray hits, from the pose of its own row. The place in the view is
found by fixed point: it depends on the depth there, since the row's pose is a little beside the
view's.

Pictures are resampled bicubically, from views that are finer than the image (`DENSITY`).
Depth is never interpolated between two surfaces: it
is that of the nearest pixel, carried to the ray along that pixel's own surface, on which inverse
depth is linear.
"""

from __future__ import annotations

import cv2
import numpy as np
from numba import njit
from numpy.typing import NDArray

from airground.core.camera import PinholeCamera
from sim.recording.row_poses import RowPoses

STEPS = 2
"""Steps of the fixed point: each leaves a hundredth of the error on a surface."""
MAX_SLOPE = 0.06
"""Most that depth changes over a pixel of one surface, as a share of it. Floor 5 m away that is
seen from 0.4 m changes by 0.024."""


def places_in_view(
    rays: NDArray[np.float64],
    rows: RowPoses,
    depth: NDArray[np.float32],
    camera: PinholeCamera,
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Where a view shows what the pixels of a tile see, and their depth.

    Args:
        rays: (H, W, 3) directions of the tile's pixels with z = 1, in the image's camera.
        rows: Poses of the image's camera at the tile's rows, in the view.
        depth: Depth of the view [m], NaN where there is nothing.
        camera: Intrinsics of the view.

    Returns:
        (H, W, 2) float32 pixels (x, y) of the view, and (H, W) float32 depth along the optical
        axis of each row's own pose [m].
    """
    places = np.empty((*rays.shape[:2], 2), np.float32)
    found = np.empty(rays.shape[:2], np.float32)
    intrinsics = np.array([camera.fx, camera.fy, camera.cx, camera.cy])
    inverse = np.empty(depth.shape, np.float32)
    _invert(depth, inverse)
    _find(rays, rows.rotations, rows.translations, inverse, intrinsics, places, found)
    return places, found


def resampled(picture: NDArray[np.uint8], places: NDArray[np.float32]) -> NDArray[np.uint8]:
    """(H, W, channels) picture at places (H, W, 2) of another."""
    nothing = np.zeros((0, 0), np.float32)
    taken = cv2.remap(picture, places, nothing, cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE)
    return np.asarray(taken, np.uint8).reshape(*places.shape[:2], -1)


# Each loop below does one kind of work along a row: so the compiler vectorizes all but the gathers.


@njit(cache=True, error_model="numpy")
def _invert(depth, inverse):  # type: ignore[no-untyped-def]
    """Inverse depth [1/m], 0 where there is nothing."""
    for row in range(len(depth)):
        for column in range(depth.shape[1]):
            one = np.float32(1) / depth[row, column]
            inverse[row, column] = one if one > 0 else np.float32(0)


@njit(cache=True, error_model="numpy")
def _find(rays, rotations, offsets, inverse, intrinsics, places, found):  # type: ignore[no-untyped-def]
    height, width = inverse.shape
    across, down = np.empty((height, width)), np.empty((height, width))
    _inverse_slopes(inverse, across, down)
    planes = inverse.reshape(-1), across.reshape(-1), down.reshape(-1)
    count = rays.shape[1]
    abc, uv, here = np.empty((3, count)), np.empty((2, count)), np.empty(count)
    for row in range(len(rays)):
        offset = offsets[row]
        moved = abs(offset[0]) + abs(offset[1]) + abs(offset[2]) > 0
        _turn(rays[row], rotations[row], intrinsics, abc[0], abc[1], abc[2], uv[0], uv[1])
        _inverse_depth(planes, height, width, uv[0], uv[1], here)
        for _ in range(STEPS if moved else 0):
            _shift(abc[0], abc[1], abc[2], here, offset, intrinsics, uv[0], uv[1])
            _inverse_depth(planes, height, width, uv[0], uv[1], here)
        _store(uv[0], uv[1], here, abc[2], offset[2], places[row], found[row])


@njit(cache=True, error_model="numpy")
def _turn(rays, R, intrinsics, a, b, c, u, v):  # type: ignore[no-untyped-def]
    """Rays (W, 3) in the view, and the pixels that they point at."""
    fx, fy, cx, cy = intrinsics
    for column in range(len(a)):
        x, y, z = rays[column, 0], rays[column, 1], rays[column, 2]
        a[column] = R[0, 0] * x + R[0, 1] * y + R[0, 2] * z
        b[column] = R[1, 0] * x + R[1, 1] * y + R[1, 2] * z
        c[column] = R[2, 0] * x + R[2, 1] * y + R[2, 2] * z
    for column in range(len(a)):
        u[column], v[column] = fx * a[column] / c[column] + cx, fy * b[column] / c[column] + cy


@njit(cache=True, error_model="numpy")
def _shift(a, b, c, here, offset, intrinsics, u, v):  # type: ignore[no-untyped-def]
    """The pixels that see the points at the view's depth on the rays from the row's own place."""
    fx, fy, cx, cy = intrinsics
    tx, ty, tz = offset
    for column in range(len(a)):
        # 1 / depth on the ray from the row's own place.
        own = here[column] * c[column] / (1 - here[column] * tz)
        w = c[column] + own * tz
        u[column] = fx * (a[column] + own * tx) / w + cx
        v[column] = fy * (b[column] + own * ty) / w + cy


@njit(cache=True, error_model="numpy")
def _store(u, v, here, c, tz, places, found):  # type: ignore[no-untyped-def]
    for column in range(len(u)):
        places[column, 0], places[column, 1] = u[column], v[column]
        depth = (1 - here[column] * tz) / (here[column] * c[column])
        found[column] = depth if here[column] > 0 else np.nan


@njit(cache=True, error_model="numpy")
def _inverse_depth(planes, height, width, u, v, here):  # type: ignore[no-untyped-def]
    """Of the nearest pixels' surfaces at places [1/m]; 0 where there is nothing.
    `planes` are inverse depth and its changes to the right and down."""
    inverse, across, down = planes
    count = len(u)
    index = np.empty(count, np.int32)
    off_x, off_y = np.empty(count), np.empty(count)
    slope_x, slope_y = np.empty(count), np.empty(count)
    right, bottom = np.float64(width - 2), np.float64(height - 2)
    for k in range(count):
        column = np.int32(min(max(u[k] + 0.5, 1.0), right))
        row = np.int32(min(max(v[k] + 0.5, 1.0), bottom))
        off_x[k], off_y[k] = u[k] - column, v[k] - row
        index[k] = row * np.int32(width) + column
    for k in range(count):
        here[k], slope_x[k], slope_y[k] = inverse[index[k]], across[index[k]], down[index[k]]
    for k in range(count):
        here[k] = here[k] + slope_x[k] * off_x[k] + slope_y[k] * off_y[k]


@njit(cache=True, error_model="numpy")
def _inverse_slopes(inverse, across, down):  # type: ignore[no-untyped-def]
    """Changes of inverse depth (H, W) to the right and down, on each pixel's own surface.
    The frame of one pixel is left out."""
    for row in range(1, len(inverse) - 1):
        here = inverse[row]
        _slopes(here[:-2], here[1:-1], here[2:], across[row, 1:-1])
        _slopes(inverse[row - 1], here, inverse[row + 1], down[row])


@njit(cache=True, error_model="numpy")
def _slopes(before, here, after, slopes):  # type: ignore[no-untyped-def]
    """The smaller changes of inverse depth to a neighbour; 0 if both are of other surfaces."""
    for k in range(len(slopes)):
        middle = np.float64(here[k])
        back, ahead = middle - before[k], after[k] - middle
        slope = back if abs(back) <= abs(ahead) else ahead
        slopes[k] = slope if abs(slope) <= MAX_SLOPE * middle else 0.0

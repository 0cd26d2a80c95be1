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
    inverse = np.nan_to_num(np.float32(1) / depth)  # 0 where there is nothing
    _find(rays, rows.rotations, rows.translations, inverse, intrinsics, places, found)
    return places, found


def resampled(picture: NDArray[np.uint8], places: NDArray[np.float32]) -> NDArray[np.uint8]:
    """(H, W, channels) picture at places (H, W, 2) of another."""
    nothing = np.zeros((0, 0), np.float32)
    taken = cv2.remap(picture, places, nothing, cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE)
    return np.asarray(taken, np.uint8).reshape(*places.shape[:2], -1)


@njit(cache=True, error_model="numpy")
def _find(rays, rotations, offsets, inverse, intrinsics, places, found):  # type: ignore[no-untyped-def]
    fx, fy, cx, cy = intrinsics
    for row in range(len(rays)):
        R, (tx, ty, tz) = rotations[row], offsets[row]
        steps = STEPS if abs(tx) + abs(ty) + abs(tz) > 0 else 0
        for column in range(rays.shape[1]):
            x, y, z = rays[row, column]
            a = R[0, 0] * x + R[0, 1] * y + R[0, 2] * z
            b = R[1, 0] * x + R[1, 1] * y + R[1, 2] * z
            c = R[2, 0] * x + R[2, 1] * y + R[2, 2] * z
            u, v = fx * a / c + cx, fy * b / c + cy
            here = _inverse_depth(inverse, u, v)
            for _ in range(steps):
                # 1 / depth on the ray from the row's own place, of the point at the view's depth.
                own = here * c / (1 - here * tz)
                w = c + own * tz
                u, v = fx * (a + own * tx) / w + cx, fy * (b + own * ty) / w + cy
                here = _inverse_depth(inverse, u, v)
            places[row, column, 0], places[row, column, 1] = u, v
            found[row, column] = (1 - here * tz) / (here * c) if here > 0 else np.nan


@njit(cache=True, error_model="numpy")
def _inverse_depth(inverse, u, v):  # type: ignore[no-untyped-def]
    """Of the nearest pixel's surface at a place [1/m]; 0 where there is nothing."""
    height, width = inverse.shape
    column = min(max(int(u + 0.5), 1), width - 2)
    row = min(max(int(v + 0.5), 1), height - 2)
    here = np.float64(inverse[row, column])
    slope_x = _slope(inverse[row, column - 1], here, inverse[row, column + 1])
    slope_y = _slope(inverse[row - 1, column], here, inverse[row + 1, column])
    return here + slope_x * (u - column) + slope_y * (v - row)


@njit(cache=True, error_model="numpy")
def _slope(before, here, after):  # type: ignore[no-untyped-def]
    """The smaller change of inverse depth to a neighbour; 0 if both are of other surfaces."""
    back, ahead = here - before, after - here
    slope = back if abs(back) <= abs(ahead) else ahead
    return slope if abs(slope) <= MAX_SLOPE * here else 0.0

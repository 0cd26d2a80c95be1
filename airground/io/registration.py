"""Depth moved from the pixels of a depth camera to those of the colour camera beside it.

The driver of a Kinect does this; where depth is stored as it was measured, the reader does."""

from __future__ import annotations

import numpy as np
from numba import njit

from airground.core.arrays import F32, F64
from airground.core.se3 import SE3
from airground.io.lens import Lens

SPREAD = 1.1
"""Width of a depth pixel in the colour image, over the distance to the next one. The spare tenth
closes cracks between neighbours whose depth differs by noise: at 1 m, noise of 2 mm moves a pixel
by 0.03 px."""
BEND_STEP_PX = 4.0
"""Spacing at which a lens's distortion is tabulated. Linear between, a Kinect's is 0.01 px off."""
NEAREST_M = 0.3
"""Depth cameras measure from here on: the table covers what is at least so far [m]."""


class Registration:
    """Moves depth images into the colour camera's image, by a calibration of both.

    Every pixel with depth is a small square at its own distance. Where several fall onto a colour
    pixel, the nearest counts; where none does, as behind an edge that only the colour camera sees
    past, depth is missing.

    Args:
        depth: Lens of the depth camera.
        colour: Lens of the colour camera.
        T_camera_depth: Pose of the depth camera in the colour camera.
    """

    def __init__(self, depth: Lens, colour: Lens, T_camera_depth: SE3) -> None:
        self.depth_size = depth.width, depth.height
        self._size = colour.height, colour.width
        self._shift = T_camera_depth.translation.astype(np.float32)
        turned = depth.rays() @ T_camera_depth.rotation.T
        self._rays = turned.astype(np.float32)
        self._pinhole = np.array(colour.intrinsics, np.float32)
        zoom = np.array(colour.intrinsics[:2]) / np.array(depth.intrinsics[:2])
        self._half = (SPREAD / 2 * zoom).astype(np.float32)
        self._bend, self._corner = _bend_table(colour, turned, T_camera_depth.translation)
        self._per_step = np.float32(colour.intrinsics[0] / BEND_STEP_PX)

    def registered(self, depth: F32) -> F32:
        """(height, width) depth along the colour camera's axis [m], NaN where missing, from depth
        along the depth camera's own."""
        into = np.full(self._size, np.inf, np.float32)
        _spread(
            depth, self._rays, self._shift, self._pinhole, self._half,
            self._bend, self._corner, self._per_step, into,
        )  # fmt: skip
        return into


def warm_up_registration() -> None:
    """Compile what registering needs."""
    lens = Lens(2, 2, (2.0, 2.0, 0.5, 0.5), ())
    Registration(lens, lens, SE3.identity()).registered(np.ones((2, 2), np.float32))


def _bend_table(colour: Lens, rays: F64, shift: F64) -> tuple[F32, F32]:
    """(rows, columns, 2) pixels of directions (x, y, 1), every `BEND_STEP_PX` over what depth
    pixels can move to; and the (2,) first direction. Empty for a pinhole camera."""
    if not colour.bends:
        return np.zeros((0, 0, 2), np.float32), np.zeros(2, np.float32)
    straight = rays[..., :2] / rays[..., 2:]
    spare = float(np.linalg.norm(shift)) * (1 + np.abs(straight).max()) / NEAREST_M
    low, high = straight.min((0, 1)) - spare, straight.max((0, 1)) + spare
    step = BEND_STEP_PX / colour.intrinsics[0]
    x, y = (np.arange(a, b + 2 * step, step) for a, b in zip(low, high, strict=True))
    grid = np.stack([*np.meshgrid(x, y), np.ones((len(y), len(x)))], axis=-1)
    pixels = colour.project(grid.reshape(-1, 3)).reshape(len(y), len(x), 2)
    return pixels.astype(np.float32), low.astype(np.float32)


@njit(cache=True, nogil=True, error_model="numpy")
def _spread(depth, rays, shift, pinhole, half, bend, corner, per_step, into):  # type: ignore[no-untyped-def]
    """Fill `into`, which is infinite, with the nearest depth of each pixel; NaN where none is."""
    fx, fy, cx, cy = pinhole
    height, width = into.shape
    last_column, last_row = np.float32(width - 1), np.float32(height - 1)
    zero = np.float32(0)
    for row in range(depth.shape[0]):
        for column in range(depth.shape[1]):
            measured = depth[row, column]
            z = measured * rays[row, column, 2] + shift[2]
            if not (measured > 0 and z > 0):
                continue
            u = (measured * rays[row, column, 0] + shift[0]) / z
            v = (measured * rays[row, column, 1] + shift[1]) / z
            if bend.size == 0:
                u, v = fx * u + cx, fy * v + cy
            else:
                u, v = _bent((u - corner[0]) * per_step, (v - corner[1]) * per_step, bend)
            left, right = np.ceil(u - half[0]), np.floor(u + half[0])
            top, bottom = np.ceil(v - half[1]), np.floor(v + half[1])
            if not (right >= zero and left <= last_column and bottom >= zero and top <= last_row):
                continue  # outside, or NaN
            for at in range(int(max(top, zero)), int(min(bottom, last_row)) + 1):
                for there in range(int(max(left, zero)), int(min(right, last_column)) + 1):
                    into[at, there] = min(into[at, there], z)
    for row in range(height):
        for column in range(width):
            if into[row, column] == np.inf:
                into[row, column] = np.nan


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _bent(x, y, bend):  # type: ignore[no-untyped-def]
    """Pixel at a place in the table, linear between its entries; NaN outside of it."""
    column, row = int(np.floor(x)), int(np.floor(y))
    nowhere = np.float32(np.nan)
    if column < 0 or row < 0 or column > bend.shape[1] - 2 or row > bend.shape[0] - 2:
        return nowhere, nowhere
    right, below = x - np.float32(column), y - np.float32(row)
    left, above = np.float32(1) - right, np.float32(1) - below
    u0 = left * bend[row, column, 0] + right * bend[row, column + 1, 0]
    u1 = left * bend[row + 1, column, 0] + right * bend[row + 1, column + 1, 0]
    v0 = left * bend[row, column, 1] + right * bend[row, column + 1, 1]
    v1 = left * bend[row + 1, column, 1] + right * bend[row + 1, column + 1, 1]
    return above * u0 + below * u1, above * v0 + below * v1

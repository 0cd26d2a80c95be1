"""How far each pixel's scene point moves across the image while a camera exposes."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from airground.core.se3 import SE3
from sim.sensors.pixel_rays import PixelRays


def pixel_motion(
    depth: NDArray[np.float32], rays: PixelRays, T_start_end: SE3
) -> NDArray[np.float32]:
    """(2, height, width) motion of each pixel's scene point along columns and rows [px]."""
    motion = np.empty((2, *depth.shape), np.float32)
    twist = T_start_end.log().astype(np.float32)
    if rays.bent is not None:
        _lens_motion(depth, rays.bent, twist, motion)
        return motion
    camera = rays.camera
    fx, fy, cx, cy = np.array([camera.fx, camera.fy, camera.cx, camera.cy], np.float32)
    x_rays = (np.arange(camera.width) - np.float64(cx)) / np.float64(fx)
    y_rays = (np.arange(camera.height) - np.float64(cy)) / np.float64(fy)
    _pinhole_motion(depth, x_rays, y_rays, np.array([fx, fy]), twist, motion)
    return motion


# Each loop below does one kind of work along a row, and has no branch: so the compiler
# vectorizes all but the gathers.


@njit(cache=True, error_model="numpy")
def _row_motion(depth, x_rays, y, focal_px, twist, mx, my):  # type: ignore[no-untyped-def]
    """Pixel motion of one row, into `mx` and `my`."""
    fx, fy = focal_px
    vx, vy, vz, wx, wy, wz = twist
    for column in range(len(depth)):
        x = x_rays[column]
        inverse = np.float32(1) / depth[column]
        inverse = inverse if inverse > 0 else np.float32(0)
        dx = -vx * inverse - (wy - wz * y)
        dy = -vy * inverse - (wz * x - wx)
        dz = -vz * inverse - (wx * y - wy * x)
        mx[column] = fx * (dx - x * dz)
        my[column] = fy * (dy - y * dz)


@njit(cache=True, error_model="numpy")
def _pinhole_motion(depth, x_rays, y_rays, focal_px, twist, motion):  # type: ignore[no-untyped-def]
    for row in range(len(depth)):
        _row_motion(
            depth[row], x_rays, y_rays[row], focal_px, twist, motion[0, row], motion[1, row]
        )


@njit(cache=True, error_model="numpy")
def _lens_motion(depth, bent, twist, motion):  # type: ignore[no-untyped-def]
    """As `_row_motion`, with a ray and a derivative for each pixel."""
    vx, vy, vz, wx, wy, wz = twist
    height, width = depth.shape
    for row in range(height):
        for column in range(width):
            x, y = bent[0, row, column], bent[1, row, column]
            inverse = np.float32(1) / depth[row, column]
            inverse = inverse if inverse > 0 else np.float32(0)
            dx = -vx * inverse - (wy - wz * y)
            dy = -vy * inverse - (wz * x - wx)
            dz = -vz * inverse - (wx * y - wy * x)
            dx, dy = dx - x * dz, dy - y * dz
            motion[0, row, column] = bent[2, row, column] * dx + bent[3, row, column] * dy
            motion[1, row, column] = bent[4, row, column] * dx + bent[5, row, column] * dy

"""Smooth edges on a picture that was drawn with one sample a pixel.

Textures are filtered where they are drawn; what such a picture lacks is that a pixel through which
an edge runs shows both sides of it. Drawing several samples a pixel mends that at two to three
times the price, in few steps of brightness, and moves depth off the pixels' centres. But the
world's edges are known and straight: so each pixel's share of both sides is worked out, and the
other side's colour is that of the next pixel (geometric post-process antialiasing, E. Persson,
Game Developer Conference 2011).
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from airground.core.camera import PinholeCamera
from airground.core.se3 import SE3
from sim.geometry.edges import Edges

_NEAR_M = 0.02
_SAME_DEPTH = 0.06  # of the depth: how far a face recedes over a pixel


def smooth_edges(
    picture: NDArray[np.uint8],
    depth: NDArray[np.float32],
    camera: PinholeCamera,
    T_world_camera: SE3,
    edges: Edges,
) -> NDArray[np.uint8]:
    """An antialiased copy of a picture that was drawn with one sample per pixel.

    Args:
        picture: (height, width, channels) picture at the pixels' centres.
        depth: (height, width) depth at the pixels' centres [m], NaN where there is nothing.
        camera: Intrinsics of the camera.
        T_world_camera: Pose of the camera.
        edges: Edges of all visible meshes.
    """
    T_camera_world = T_world_camera.inverse()
    eye = T_world_camera.translation
    smooth = picture.copy()
    _smooth(
        picture,
        depth,
        np.array([camera.fx, camera.fy, camera.cx, camera.cy]),
        np.column_stack([T_camera_world.rotation, T_camera_world.translation]),
        _in_front(edges.planes, eye.astype(np.float32)),
        edges.ends,
        edges.faces,
        edges.creased,
        smooth,
    )
    return smooth


@njit(cache=True)
def _in_front(planes, eye):  # type: ignore[no-untyped-def]
    """(T,) bool whether the eye is on the outer side of each plane."""
    x, y, z = eye
    front = np.empty(len(planes), np.bool_)
    for face in range(len(planes)):
        front[face] = (
            planes[face, 0] * x + planes[face, 1] * y + planes[face, 2] * z > planes[face, 3]
        )
    return front


@njit(cache=True)
def _smooth(  # type: ignore[no-untyped-def]
    picture, depth, intrinsics, T_camera_world, front, ends, faces, creased, smooth
):
    """Mix the pixels along every edge that shows."""
    turned, turned_depth = picture.transpose(1, 0, 2), depth.T
    turned_smooth = smooth.transpose(1, 0, 2)
    line = np.empty((2, 3))
    for edge in range(len(ends)):
        one, other = front[faces[edge, 0]], front[faces[edge, 1]]
        outline = one != other
        if not (outline or (one and creased[edge])):
            continue
        if not _project(ends[edge], intrinsics, T_camera_world, line):
            continue
        if abs(line[1, 0] - line[0, 0]) >= abs(line[1, 1] - line[0, 1]):
            _mix_along(line, picture, depth, smooth)
        else:  # the same, rows for columns
            for end in range(2):
                line[end, 0], line[end, 1] = line[end, 1], line[end, 0]
            _mix_along(line, turned, turned_depth, turned_smooth)


@njit(cache=True)
def _project(ends, intrinsics, T_camera_world, line):  # type: ignore[no-untyped-def]
    """The ends' column, row and 1 / z into `line`; false if all of it is behind the camera."""
    fx, fy, cx, cy = intrinsics
    near = np.empty(2)
    for end in range(2):
        near[end] = _camera_point(T_camera_world, ends[end])[2] - _NEAR_M
    if near.max() <= 0:
        return False
    for end in range(2):
        point = ends[end]
        if near[end] < 0:  # cut off what is behind
            point = point + (ends[1 - end] - point) * (near[end] / (near[end] - near[1 - end]))
        x, y, z = _camera_point(T_camera_world, point)
        line[end, 0], line[end, 1], line[end, 2] = fx * x / z + cx, fy * y / z + cy, 1 / z
    return True


@njit(cache=True)
def _camera_point(T_camera_world, point):  # type: ignore[no-untyped-def]
    x, y, z = point
    T = T_camera_world
    return (
        T[0, 0] * x + T[0, 1] * y + T[0, 2] * z + T[0, 3],
        T[1, 0] * x + T[1, 1] * y + T[1, 2] * z + T[1, 3],
        T[2, 0] * x + T[2, 1] * y + T[2, 2] * z + T[2, 3],
    )


@njit(cache=True)
def _mix_along(line, picture, depth, smooth):  # type: ignore[no-untyped-def]
    """Mix the two pixels of every column that a line crosses; it rises by at most 1 a column."""
    height, width, channels = picture.shape
    left, right = (0, 1) if line[0, 0] <= line[1, 0] else (1, 0)
    start, length = line[left, 0], line[right, 0] - line[left, 0]
    if length == 0 or start > width - 1 or line[right, 0] < 0:
        return
    rise = (line[right, 1] - line[left, 1]) / length
    change = (line[right, 2] - line[left, 2]) / length
    first, last = max(int(np.ceil(start)), 0), min(int(np.floor(line[right, 0])), width - 1)
    for column in range(first, last + 1):
        row = line[left, 1] + rise * (column - start)
        if not 0 <= row < height - 1:
            continue
        above = int(row)
        below = above + 1
        inverse = line[left, 2] + change * (column - start)
        if not (
            abs(depth[above, column] * inverse - 1) < _SAME_DEPTH
            or abs(depth[below, column] * inverse - 1) < _SAME_DEPTH
        ):
            continue  # something hides it
        beyond_above = share_beyond(row - above, abs(rise))
        beyond_below = share_beyond(below - row, abs(rise))
        for channel in range(channels):
            own, other = picture[above, column, channel], picture[below, column, channel]
            smooth[above, column, channel] = _mixed(
                smooth[above, column, channel], other, beyond_above
            )
            smooth[below, column, channel] = _mixed(
                smooth[below, column, channel], own, beyond_below
            )


@njit(cache=True)
def share_beyond(distance, rise):  # type: ignore[no-untyped-def]
    """Share of a pixel beyond a line at `distance` >= 0 from its centre along the column [px].
    The line rises by `rise` from one column to the next [px], 0 to 1.
    """
    whole_width = (1 - rise) / 2  # nearer lines leave the pixel at its sides
    if distance <= whole_width:
        return 0.5 - distance
    corner = (1 + rise) / 2 - distance
    return corner * corner / (2 * rise) if corner > 0 else 0.0


@njit(cache=True)
def _mixed(own, other, share):  # type: ignore[no-untyped-def]
    return np.uint8(own + share * (np.float64(other) - own) + 0.5)

"""Finding points of the map again that are not followed any more."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from airground.core.arrays import F32, F64, I64, U8, Mask
from airground.core.camera import PinholeCamera
from airground.core.se3 import SE3, rotation_angle
from airground.slam.optical_flow import flow_both_ways
from airground.slam.sparse_map import SparseMap

MAX_TURN_DEG = 20.0
MAX_ZOOM = 1.35
"""Seen from farther apart than this, a patch looks like another."""
MAX_RETURN_PX = 0.7
BORDER_PX = 10


def visible(points_map: F64, T_map_camera: SE3, camera: PinholeCamera) -> tuple[F64, Mask]:
    """(N, 2) pixels of points and (N,) whether they lie well inside the image."""
    pixels = camera.project(T_map_camera.inverse() @ points_map)
    with np.errstate(invalid="ignore"):
        inside = (pixels >= BORDER_PX).all(axis=1)
        inside &= (pixels[:, 0] < camera.width - BORDER_PX) & (
            pixels[:, 1] < camera.height - BORDER_PX
        )
    return pixels, inside


def keyframes_in_view(
    sparse_map: SparseMap,
    candidates: Sequence[int],
    T_map_camera: SE3,
    T_rig_camera: SE3,
    points_in_view: I64,
    count: int,
    least: int,
    max_turn_deg: float = MAX_TURN_DEG,
) -> list[int]:
    """The keyframes with a similar view that saw most of the points.

    Args:
        candidates: Keyframes to choose from.
        points_in_view: Numbers of the points that the view should see.
        count: Most keyframes to return.
        least: Least number of the points that a keyframe must have seen.
        max_turn_deg: Largest turn between similar views [deg].
    """
    seen = sparse_map.shared(points_in_view)
    shared = np.zeros_like(seen)
    shared[list(candidates)] = seen[list(candidates)]
    axis = T_map_camera.rotation[:, 2]
    chosen: list[int] = []
    for k in np.argsort(-shared, kind="stable"):
        if shared[k] < least or len(chosen) == count:
            break
        keyframe = sparse_map.keyframes[k]
        R_map_camera = keyframe.state.rotation @ T_rig_camera.rotation
        turn = rotation_angle(T_map_camera.rotation.T @ R_map_camera)
        ids = keyframe.ids[sparse_map.mapped(keyframe.ids)]
        centre = sparse_map.positions[ids].mean(axis=0)
        here = float(axis @ (centre - T_map_camera.translation))
        there = float(R_map_camera[:, 2] @ (centre - keyframe.state.position))
        zoom = max(here, there) / max(min(here, there), 1e-6)
        if np.rad2deg(turn) < max_turn_deg and zoom < MAX_ZOOM:
            chosen.append(int(k))
    return chosen


def find_again(
    sparse_map: SparseMap,
    keyframe: int,
    ids: I64,
    image: U8,
    start: F64,
    window_px: int,
    levels: int,
) -> tuple[I64, F32]:
    """Follow points from the old keyframe of an index, as `find_in_keyframes` does."""
    old = sparse_map.keyframes[keyframe]
    order = np.argsort(old.ids)
    rows = order[np.searchsorted(old.ids, ids, sorter=order)]
    pixels = old.in_image()[rows].astype(np.float32)
    found_px, found = flow_both_ways(
        old.image, image, pixels, start.astype(np.float32), window_px, levels, MAX_RETURN_PX
    )
    return ids[found], found_px[found]


def find_in_keyframes(
    sparse_map: SparseMap,
    keyframes: list[int],
    ids: I64,
    image: U8,
    expected: F64,
    window_px: int,
    levels: int,
    search_px: float = np.inf,
) -> tuple[I64, F32]:
    """Follow points from several old keyframes into an image, each from the first that has it.

    Args:
        keyframes: Indices of the keyframes, the most similar view first.
        ids: (n,) numbers of the points, sorted.
        expected: (n, 2) expected pixels of the points in `image`.
        window_px, levels: Patch size and pyramid levels as in `optical_flow.flow`.
        search_px: Largest distance of a point from its expected pixel [px].

    Returns:
        Numbers of the points that were found, and (m, 2) pixels in `image`.
    """
    found_ids = [np.empty(0, np.int64)]
    found_px = [np.empty((0, 2), np.float32)]
    for k in keyframes:
        rows = np.isin(ids, sparse_map.keyframes[k].ids)
        again, pixels = find_again(
            sparse_map, k, ids[rows], image, expected[rows], window_px, levels
        )
        off_px = np.linalg.norm(pixels - expected[np.searchsorted(ids, again)], axis=1)
        again, pixels = again[off_px < search_px], pixels[off_px < search_px]
        found_ids.append(again)
        found_px.append(pixels)
        left = ~np.isin(ids, again)
        ids, expected = ids[left], expected[left]
    return np.concatenate(found_ids), np.concatenate(found_px)

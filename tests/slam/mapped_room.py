"""A map of the synthetic room with true poses and true points, for tests of what extends it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from airground.core.se3 import SE3
from airground.slam.corners import detect_corners
from airground.slam.rig_state import RigState
from airground.slam.sparse_map import Keyframe, SparseMap
from tests.slam.synthetic_world import CAMERA, R_BODY_DOWN, cast

T_RIG_CAMERA = SE3(R_BODY_DOWN, np.array([0.05, 0.01, -0.03]))
NOISE_LEVELS = 1.5


@dataclass(frozen=True, eq=False)
class View:
    """What a camera over the room sees: image, depth [m], and from where."""

    image: NDArray[np.uint8]
    depth: NDArray[np.float32]
    T_map_camera: SE3

    @property
    def state(self) -> RigState:
        return RigState.at_origin().posed(self.T_map_camera @ T_RIG_CAMERA.inverse())


@cache
def view(
    x: float, y: float, z: float = 2.0, heading: float = 0.0, pitch: float = 0.0, seed: int = 0
) -> View:
    """The camera at a place over the room, looking down."""
    turn = SE3.from_heading(heading) @ SE3.from_rotation_vector((0.0, pitch, 0.0))
    pose = SE3(turn.rotation @ R_BODY_DOWN, np.array([x, y, z]))
    grey, depth, _ = cast(pose)
    grey = grey + np.random.default_rng(seed).normal(0, NOISE_LEVELS, grey.shape)
    return View(np.rint(grey).clip(0, 255).astype(np.uint8), depth, pose)


def true_points(
    seen: View, pixels: NDArray, spread: float = 0.01
) -> tuple[NDArray, NDArray[np.bool_]]:
    """(n, 3) points at corners, and (n,) which are not on an edge where depth jumps."""
    x, y = np.rint(pixels).astype(int).T
    near = np.stack([seen.depth[y + dy, x + dx] for dy in (-2, 0, 2) for dx in (-2, 0, 2)])
    rays = np.column_stack([pixels, np.ones(len(x))]) @ np.linalg.inv(CAMERA.matrix()).T
    points = seen.T_map_camera @ (rays * seen.depth[y, x][:, None].astype(float))
    return points, np.ptp(near, axis=0) < spread


def sees(seen: View, points: NDArray) -> tuple[NDArray, NDArray[np.bool_]]:
    """(n, 2) true pixels of points, and (n,) whether nothing hides them."""
    camera_points = seen.T_map_camera.inverse() @ points
    pixels = CAMERA.project(camera_points)
    inside = ((pixels > 12) & (pixels < (CAMERA.width - 13, CAMERA.height - 13))).all(axis=1)
    x, y = np.rint(np.where(inside[:, None], pixels, 20)).astype(int).T
    return pixels, inside & (np.abs(seen.depth[y, x] - camera_points[:, 2]) < 0.02)


def room_map(views: list[View], spacing_px: int = 16) -> SparseMap:
    """Keyframes at the views, each with new corners and those of the others it sees."""
    sparse_map = SparseMap()
    nothing = np.empty((0, 2), np.float32)
    for number, seen in enumerate(views):
        corners = detect_corners(seen.image, nothing, 150, spacing_px).astype(float)
        points, clear = true_points(seen, corners)
        ids = sparse_map.new_points(corners[clear], number)
        sparse_map.place(ids, points[clear])
    everything = sparse_map.positions[: len(sparse_map)]
    for number, seen in enumerate(views):
        pixels, visible = sees(seen, everything)
        ids = np.flatnonzero(visible)
        sparse_map.keyframes.append(
            Keyframe(
                number * 10**9,
                seen.image,
                seen.state,
                ids,
                pixels[ids],
                np.full(len(ids), np.nan),
            )
        )
    return sparse_map

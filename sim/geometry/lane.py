"""The ground robot's lane, and how far things lie from it."""

from __future__ import annotations

from itertools import pairwise

import cv2
import numpy as np
from numpy.typing import NDArray

from sim.scene import Scene


def lane_points(scene: Scene, step_m: float = 0.03) -> NDArray[np.float64]:
    """(N, 2) points along the ground robot's waypoints, `step_m` apart [m]."""
    corners = np.array(scene.ground.waypoints)[:, :2]
    pieces = [corners[:1]]
    for start, end in pairwise(corners):
        count = int(np.ceil(np.linalg.norm(end - start) / step_m))
        if count:
            pieces.append(start + (end - start) * np.linspace(0, 1, count + 1)[1:, None])
    return np.concatenate(pieces)


def distance_to_footprint(points: NDArray, corners: NDArray) -> float:
    """Smallest horizontal distance [m] of points (N, 2) to a convex body; 0 inside.

    The hull of its `corners` (C, 3) [m] seen from above is its footprint.
    """
    hull = cv2.convexHull(corners[:, :2].astype(np.float32))[:, 0].astype(np.float64)
    edges = np.roll(hull, -1, axis=0) - hull
    offsets = points[:, None] - hull[None]
    along = np.einsum("nek,ek->ne", offsets, edges) / np.maximum((edges**2).sum(1), 1e-12)
    nearest = hull + np.clip(along, 0, 1)[..., None] * edges
    distance = np.linalg.norm(points[:, None] - nearest, axis=2).min(1)
    side = edges[:, 0] * offsets[..., 1] - edges[:, 1] * offsets[..., 0]
    inside = (side >= 0).all(1) | (side <= 0).all(1)
    return float(np.where(inside, 0.0, distance).min())

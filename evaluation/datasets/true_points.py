"""Points of the true surface, and which of them a camera sees."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import open3d as o3d
from numpy.typing import NDArray

from airground.core.camera import PinholeCamera
from airground.core.cloud import PointCloud
from airground.core.se3 import SE3
from sim.recording.truth import Truth

GREY = 128
NEAR = 1e-3
"""A ray that ends this share of its length before a point hit the point's own surface."""


@dataclass(frozen=True, eq=False)
class Seen:
    """Points in one image.

    Attributes:
        indices: (M,) which of all points.
        pixels: (M, 2) where they are; integer coordinates are pixel centres.
    """

    indices: NDArray[np.int64]
    pixels: NDArray[np.float64]


def sample_surface(truth: Truth, count: int) -> PointCloud:
    """Points spread evenly over the true surface, in the world, the same every time."""
    mesh = o3d.io.read_triangle_mesh(truth.folder / "surface.ply")
    corners = np.asarray(mesh.vertices)[np.asarray(mesh.triangles)]
    areas = np.linalg.norm(
        np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1
    )
    rng = np.random.default_rng(0)
    chosen = corners[rng.choice(len(corners), count, p=areas / areas.sum())]
    # The square root spreads them evenly over a triangle.
    far, along = np.sqrt(rng.random(count))[:, None], rng.random(count)[:, None]
    points = (
        (1 - far) * chosen[:, 0] + far * (1 - along) * chosen[:, 1] + far * along * chosen[:, 2]
    )
    return PointCloud(points.astype(np.float32), np.full((count, 3), GREY, np.uint8))


def seen_by(
    truth: Truth, camera: PinholeCamera, T_world_camera: SE3, points_world: NDArray
) -> Seen:
    """The points that lie in the image and are hidden by nothing.

    Args:
        truth: Its surface may hide points.
        camera: True intrinsics.
        T_world_camera: True pose.
        points_world: (N, 3) on the surface.
    """
    pixels = camera.project(T_world_camera.inverse() @ points_world)
    x, y = pixels.T
    with np.errstate(invalid="ignore"):
        inside = (x > -0.5) & (x < camera.width - 0.5) & (y > -0.5) & (y < camera.height - 0.5)
    indices = np.flatnonzero(inside)
    origin = T_world_camera.translation
    rays = np.empty((len(indices), 6), np.float32)
    rays[:, :3], rays[:, 3:] = origin, points_world[indices] - origin
    hits = truth.surface.cast_rays(o3d.core.Tensor.from_numpy(rays))["t_hit"].numpy()
    clear = hits >= 1 - NEAR
    return Seen(indices[clear], pixels[indices[clear]])


def colours_at(image: NDArray[np.uint8], pixels: NDArray[np.float64]) -> NDArray[np.uint8]:
    """(M, 3) RGB of the nearest pixels of a grey (H, W) or colour (H, W, 3) image."""
    x, y = np.rint(pixels).astype(int).T
    colours = image[y, x]
    return colours if colours.ndim == 2 else np.repeat(colours[:, None], 3, axis=1)

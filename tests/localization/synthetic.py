"""Heaps of boxes without physics: what both robots would see of them, and the truth.

A heap is a pile of slightly tilted boxes with a corridor through it. The ground robot's
cloud is ray-cast from a camera driven through the corridor (or around the heap), with the
noise of a Kinect; the aerial cloud is ray-cast from above, with the noise and the smeared
outlines of a multi-view reconstruction.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import open3d as o3d
from numpy.typing import NDArray

from airground.core.se3 import SE3, nearest_rotation

CORRIDOR_M = 0.9
AREA_M = (5.0, 4.0)


@dataclass(frozen=True, eq=False)
class Heap:
    """A scene that rays can be cast into; world coordinates, z up, floor at 0."""

    raycasting: o3d.t.geometry.RaycastingScene


@dataclass(frozen=True)
class Box:
    """A box on the pile: size [m], place (x, y) [m], turn about z and tilt about x and y [rad]."""

    size: NDArray[np.float64]
    place: tuple[float, float]
    yaw: float
    tilt: NDArray[np.float64]


def random_boxes(rng: np.random.Generator, count: int) -> list[Box]:
    """Boxes over 5 x 4 m on both sides of a corridor along x."""
    boxes = []
    for _ in range(count):
        size = rng.uniform((0.2, 0.2, 0.15), (0.6, 0.45, 0.45))
        side = rng.choice((-1.0, 1.0))
        reach = AREA_M[1] / 2 - CORRIDOR_M / 2
        x = rng.uniform(-AREA_M[0] / 2, AREA_M[0] / 2)
        y = side * (CORRIDOR_M / 2 + 0.2 + (reach - 0.2) * rng.beta(1.2, 1.6))
        yaw, tilt = rng.uniform(0, np.pi), rng.normal(0, 0.12, 2)
        boxes.append(Box(size, (x, y), yaw, tilt))
    return boxes


def pile_up(boxes: list[Box]) -> Heap:
    """Each box on top of those before it; one that would be higher than 1.1 m is left out."""
    pile = np.zeros((int(AREA_M[0] * 20) + 60, int(AREA_M[1] * 20) + 60))
    scene = o3d.t.geometry.RaycastingScene()
    _add(scene, np.eye(3), np.array([0.0, 0.0, -0.05]), np.array([14.0, 14.0, 0.1]))
    for box in boxes:
        (x, y), size = box.place, box.size
        rotation = SE3.from_rotation_vector((0, 0, box.yaw)).rotation
        rotation = SE3.from_rotation_vector((*box.tilt, 0.0)).rotation @ rotation
        radius = 0.4 * min(size[0], size[1])
        columns = _columns(pile, x, y, radius)
        z = pile[columns].max() + size[2] / 2
        if z > 1.1:
            continue
        pile[columns] = z + size[2] / 2
        _add(scene, rotation, np.array([x, y, z]), size)
    return Heap(scene)


def box_heap(seed: int, boxes: int = 80) -> Heap:
    """A heap of random boxes over 5 x 4 m, parted by a corridor along x."""
    return pile_up(random_boxes(np.random.default_rng(seed), boxes))


def flat_world() -> Heap:
    """A floor and nothing else."""
    scene = o3d.t.geometry.RaycastingScene()
    _add(scene, np.eye(3), np.array([0.0, 0.0, -0.05]), np.array([14.0, 14.0, 0.1]))
    return Heap(scene)


def aerial_points(
    heap: Heap, x: float, y: float, rng: np.random.Generator, heading: float = 0.0
) -> NDArray[np.float32]:
    """(N, 3) what the MAV reconstructs from 2.2 m above (x, y), in the world frame."""
    look_down = np.array([[0.0, -1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
    rotation = SE3.from_heading(heading).rotation @ look_down
    pose = SE3(nearest_rotation(rotation), np.array([x, y, 2.2]))
    rays, depth, _ = _cast(heap, pose, 376, 240, 210.0)
    depth = depth + rng.normal(0, 0.005, depth.shape)
    # Foreground fattening: the depth near an outline is that of the nearer side.
    nearer = _erode(depth, 1)
    fattened = (depth - nearer > 0.05) & (rng.random(depth.shape) < 0.7)
    depth = np.where(fattened, nearer, depth)
    keep = np.isfinite(depth) & (rng.random(depth.shape) > 0.03)
    return ((rays * depth[..., None])[keep] @ rotation.T + pose.translation).astype(np.float32)


def ground_points(
    heap: Heap, rng: np.random.Generator, around: bool = False, frames: int = 60
) -> NDArray[np.float32]:
    """(N, 3) the ground robot's map, averaged over 2 cm cubes, in the world frame."""
    clouds = []
    for k in range(frames):
        s = k / (frames - 1)
        if around:
            angle = 2 * np.pi * s
            position = np.array([3.3 * np.cos(angle), 2.8 * np.sin(angle), 0.4])
            yaw = angle + np.pi + 0.5 * np.sin(25 * s)
        else:
            position = np.array([-3.0 + 5.5 * s, 0.1 * np.sin(6 * s), 0.7])
            yaw = 1.2 * np.sin(40 * s)
        clouds.append(_kinect(heap, position, yaw, np.deg2rad(20.0), rng))
    cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(np.concatenate(clouds)))
    return np.asarray(cloud.voxel_down_sample(0.02).points).astype(np.float32)


def _kinect(
    heap: Heap, position: NDArray, yaw: float, pitch: float, rng: np.random.Generator
) -> NDArray[np.float64]:
    """(N, 3) world points of one depth image with noise and drop-out."""
    forward = np.array([np.cos(yaw) * np.cos(pitch), np.sin(yaw) * np.cos(pitch), -np.sin(pitch)])
    right = np.array([np.sin(yaw), -np.cos(yaw), 0.0])
    rotation = nearest_rotation(np.column_stack([right, np.cross(forward, right), forward]))
    pose = SE3(rotation, position)
    rays, depth, cosine = _cast(heap, pose, 213, 160, 195.0)
    sigma = 0.0012 + 0.0019 * (depth - 0.4) ** 2
    noisy = depth + sigma * rng.normal(size=depth.shape)
    silhouette = (depth - _erode(depth, 1) > 0.08) & (rng.random(depth.shape) < 0.7)
    seen = (depth > 0.45) & (depth < 4.0) & (cosine > 0.15) & ~silhouette
    return (rays * noisy[..., None])[seen] @ rotation.T + position


def _cast(
    heap: Heap, pose: SE3, width: int, height: int, focal_px: float
) -> tuple[NDArray, NDArray, NDArray]:
    """Rays (h, w, 3) with z = 1, depth (h, w), and cosine of the incidence (h, w)."""
    u, v = np.meshgrid(np.arange(width) - width / 2, np.arange(height) - height / 2)
    rays = np.stack([u / focal_px, v / focal_px, np.ones_like(u)], axis=-1)
    directions = rays @ pose.rotation.T
    origins = np.broadcast_to(pose.translation, directions.shape)
    hit = heap.raycasting.cast_rays(
        o3d.core.Tensor(np.concatenate([origins, directions], axis=-1).astype(np.float32))
    )
    depth = hit["t_hit"].numpy().astype(np.float64)
    depth[~np.isfinite(depth)] = np.nan
    normals = hit["primitive_normals"].numpy()
    cosine = np.abs((normals * directions).sum(-1)) / np.linalg.norm(directions, axis=-1)
    return rays, depth, cosine


def _erode(depth: NDArray, reach: int) -> NDArray:
    """Smallest depth within `reach` pixels, along both image axes."""
    padded = np.pad(np.nan_to_num(depth, nan=np.inf), reach, mode="edge")
    views = np.lib.stride_tricks.sliding_window_view(padded, (2 * reach + 1,) * 2)
    return views.min(axis=(2, 3))


def _columns(pile: NDArray, x: float, y: float, radius: float) -> tuple[slice, slice]:
    cx, cy = int((x + 4.0) * 20), int((y + 3.5) * 20)
    r = max(1, int(radius * 20))
    return slice(cx - r, cx + r + 1), slice(cy - r, cy + r + 1)


def _add(
    scene: o3d.t.geometry.RaycastingScene, rotation: NDArray, centre: NDArray, size: NDArray
) -> None:
    mesh = o3d.geometry.TriangleMesh.create_box(*size)
    mesh.translate(-np.asarray(size) / 2)
    mesh.rotate(rotation, center=(0, 0, 0))
    mesh.translate(centre)
    scene.add_triangles(o3d.t.geometry.TriangleMesh.from_legacy(mesh))

"""Exact truth of every pixel of a recorded image: depth, normals, things, optical flow.

It follows from the stored motion, calibration and surface: a pixel shows what the ray through its
centre hits. Nothing is interpolated.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import open3d as o3d
from numpy.typing import NDArray

from airground.io.lens import Lens
from sim.geometry.parts import Instances
from sim.recording.row_poses import RowPoses
from sim.recording.truth import Truth
from sim.robots.motion import Robot

HIDDEN_SHARE = 1e-4
"""A ray that ends this share of its length before a point hit something in front of it."""
ROW_STEPS = 5
"""Steps of the search for a point's row: each leaves a tenth of the error at 3 rad/s."""


@dataclass(frozen=True, eq=False)
class PixelTruth:
    """What every pixel of one image shows.

    Attributes:
        lens: True intrinsics, distortion and shutter.
        poses: True pose `T_world_camera` when each row was taken.
        depth: (height, width) float32 along the optical axis [m], NaN where there is nothing.
        triangle: (height, width) int64 triangle of the robot's surface, -1 where there is nothing;
            those of bodies that move are counted on from it.
        time_ns: Time of the motion at which the middle row was taken [ns].
        normals: (height, width, 3) float32 unit normals in the camera's frame, toward the camera;
            NaN where there is nothing.

    With a rolling shutter, axis and frame are those of the camera at the pixel's own row.
    """

    lens: Lens
    poses: RowPoses
    depth: NDArray[np.float32]
    triangle: NDArray[np.int64]
    normals: NDArray[np.float32]
    time_ns: int

    def points_world(self) -> NDArray[np.float64]:
        """(height, width, 3) places of the pixels in `world` [m], NaN where there is nothing."""
        points = self.lens.rays() * self.depth.astype(np.float64)[..., None]
        turned = np.einsum("hij,hwj->hwi", self.poses.rotations, points)
        return turned + self.poses.translations[:, None]


def pixel_truth(truth: Truth, robot: Robot, stamp_ns: int) -> PixelTruth:
    """The truth of one image, by its nominal stamp [ns]."""
    lens, poses = truth.lens(robot), truth.row_poses(robot, stamp_ns)
    rays_camera = lens.rays()
    rays, time_ns = poses.rays_world(rays_camera), truth.time_ns(robot, stamp_ns)
    answer = truth.surface(robot).scene.cast_rays(rays)
    depth = answer["t_hit"].numpy()  # the rays have z = 1 in the camera
    triangle = answer["primitive_ids"].numpy().astype(np.int64)
    normals = answer["primitive_normals"].numpy()
    if truth.bodies.bodies:
        hits = truth.bodies.hits(robot, rays.numpy(), time_ns)
        nearer = hits.distance < depth
        depth = np.where(nearer, hits.distance, depth)
        count = len(truth.surface(robot).mesh.triangles)
        triangle = np.where(nearer, count + hits.triangle, triangle)
        normals = np.where(nearer[..., None], hits.normals, normals)
    hit = np.isfinite(depth)
    normals = normals @ poses.rotations
    away = np.einsum("ijk,ijk->ij", normals, rays_camera) > 0
    normals = np.where(away[..., None], -normals, normals)
    return PixelTruth(
        lens=lens,
        poses=poses,
        depth=np.where(hit, depth, np.nan).astype(np.float32),
        triangle=np.where(hit, triangle, -1),
        normals=np.where(hit[..., None], normals, np.nan).astype(np.float32),
        time_ns=time_ns,
    )


def instances_of(truth: Truth, robot: Robot) -> Instances:
    """The things that a robot sees; RecordingError if their list is missing or does not fit the
    surface. A thing has the same id for both robots."""
    bodies = truth.bodies.parts
    return Instances.of([*truth.surface(robot).parts, *bodies], truth.surface("ground").parts)


def instance_ids(seen: PixelTruth, instances: Instances) -> NDArray[np.uint16]:
    """(height, width) id of the thing at every pixel; 0 where there is nothing."""
    ids = instances.of_triangle[seen.triangle]
    return np.where(seen.triangle >= 0, ids, 0).astype(np.uint16)


@dataclass(frozen=True, eq=False)
class Flow:
    """Motion of what the pixels of one image show, to another image of the same camera.

    Attributes:
        flow_px: (height, width, 2) float32 along columns and rows [px]; NaN where there is nothing
            or it is behind the other image's camera.
        visible: (height, width) whether the other image shows the same place: it lies in the
            image, and nothing is in front of it.
    """

    flow_px: NDArray[np.float32]
    visible: NDArray[np.bool_]


def flow(truth: Truth, robot: Robot, seen: PixelTruth, other_stamp_ns: int) -> Flow:
    """Flow from an image to the one with another stamp [ns]."""
    lens, others = seen.lens, truth.row_poses(robot, other_stamp_ns)
    points, other_ns = seen.points_world().reshape(-1, 3), truth.time_ns(robot, other_stamp_ns)
    if truth.bodies.bodies:
        of_bodies = seen.triangle.ravel() - len(truth.surface(robot).mesh.triangles)
        points = truth.bodies.carried(points, of_bodies, seen.time_ns, other_ns)
    moved, eyes = _projected(lens, others, points)
    inside = ((moved >= -0.5) & (moved <= np.array([lens.width, lens.height]) - 0.5)).all(1)
    visible = inside & _unhidden(truth, robot, other_ns, eyes, points)
    columns, rows = np.meshgrid(np.arange(lens.width), np.arange(lens.height))
    shape = (lens.height, lens.width)
    at = np.stack([columns, rows], axis=-1)
    return Flow((moved.reshape(*shape, 2) - at).astype(np.float32), visible.reshape(shape))


def _projected(lens: Lens, poses: RowPoses, points: NDArray) -> tuple[NDArray, NDArray]:
    """(N, 2) pixels of points (N, 3) in the world, and (N, 3) places of the camera then.

    The pose is that of the point's row, which follows from the pose: a fixed point, from the
    middle row on. A point beyond the first or last row has the pose of that row.
    """
    rows = np.full(len(points), (lens.height - 1) / 2)
    pixels, eyes = points[:, :2], points
    for _ in range(1 if poses.is_one else ROW_STEPS):
        rotations, eyes = poses.at(rows)
        pixels = lens.project(np.einsum("nji,nj->ni", rotations, points - eyes))
        found = np.where(np.isfinite(pixels[:, 1]), pixels[:, 1], rows)
        rows = np.clip(found, 0, lens.height - 1)
    return pixels, eyes


def _unhidden(
    truth: Truth, robot: Robot, time_ns: int, eyes: NDArray, points: NDArray
) -> NDArray[np.bool_]:
    """(N,) whether nothing is between each of the eyes (N, 3) and its point (N, 3)."""
    known = np.isfinite(points).all(1)
    clear = np.zeros(len(points), np.bool_)
    rays = np.concatenate([eyes, points - eyes], axis=1)[known].astype(np.float32)
    surface = truth.surface(robot).scene
    hits = surface.cast_rays(o3d.core.Tensor.from_numpy(rays))["t_hit"].numpy()
    if truth.bodies.bodies:
        hits = np.minimum(hits, truth.bodies.hits(robot, rays, time_ns).distance)
    clear[known] = hits > 1 - HIDDEN_SHARE
    return clear

"""Exact truth of every pixel of a recorded image: depth, normals, things, optical flow.

It follows from the stored motion, calibration and surface: a pixel shows what the ray through its
centre hits. Nothing is interpolated.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import open3d as o3d
from numpy.typing import NDArray

from airground.core.camera import PinholeCamera
from airground.core.se3 import SE3
from sim.geometry.parts import Instances
from sim.recording.true_surface import TrueSurface
from sim.recording.truth import Truth
from sim.robots.motion import Robot

HIDDEN_SHARE = 1e-4
"""A ray that ends this share of its length before a point hit something in front of it."""


@dataclass(frozen=True, eq=False)
class PixelTruth:
    """What every pixel of one image shows.

    Attributes:
        camera, T_world_camera: True intrinsics, and true pose when the image was taken.
        depth: (height, width) float32 along the optical axis [m], NaN where there is nothing.
        triangle: (height, width) int64 triangle of the robot's surface, -1 where there is nothing.
        normals: (height, width, 3) float32 unit normals in the camera's frame, toward the camera;
            NaN where there is nothing.
    """

    camera: PinholeCamera
    T_world_camera: SE3
    depth: NDArray[np.float32]
    triangle: NDArray[np.int64]
    normals: NDArray[np.float32]

    def points_world(self) -> NDArray[np.float64]:
        """(height, width, 3) places of the pixels in `world` [m], NaN where there is nothing."""
        points = self.camera.back_project(self.depth.astype(np.float64))
        return (self.T_world_camera @ points.reshape(-1, 3)).reshape(points.shape)


def pixel_truth(truth: Truth, robot: Robot, stamp_ns: int) -> PixelTruth:
    """The truth of one image, by its nominal stamp [ns]."""
    camera, T_world_camera = truth.camera(robot), truth.T_world_camera(robot, stamp_ns)
    rays_camera = camera.rays()
    answer = _cast(
        truth.surface(robot), T_world_camera.translation, rays_camera @ T_world_camera.rotation.T
    )
    depth = answer["t_hit"].numpy()  # the rays have z = 1 in the camera
    hit = np.isfinite(depth)
    normals = answer["primitive_normals"].numpy() @ T_world_camera.rotation
    away = np.einsum("ijk,ijk->ij", normals, rays_camera) > 0
    normals = np.where(away[..., None], -normals, normals)
    return PixelTruth(
        camera=camera,
        T_world_camera=T_world_camera,
        depth=np.where(hit, depth, np.nan).astype(np.float32),
        triangle=np.where(hit, answer["primitive_ids"].numpy().astype(np.int64), -1),
        normals=np.where(hit[..., None], normals, np.nan).astype(np.float32),
    )


def instances_of(truth: Truth, robot: Robot) -> Instances:
    """The things that a robot sees; RecordingError if their list is missing or does not fit the
    surface. A thing has the same id for both robots."""
    return Instances.of(truth.surface(robot).parts, truth.surface("ground").parts)


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
    camera, T_world_other = seen.camera, truth.T_world_camera(robot, other_stamp_ns)
    points = seen.points_world().reshape(-1, 3)
    moved = camera.project(T_world_other.inverse() @ points)
    inside = ((moved >= -0.5) & (moved <= np.array([camera.width, camera.height]) - 0.5)).all(1)
    visible = inside & _unhidden(truth.surface(robot), T_world_other.translation, points)
    columns, rows = np.meshgrid(np.arange(camera.width), np.arange(camera.height))
    shape = (camera.height, camera.width)
    at = np.stack([columns, rows], axis=-1)
    return Flow((moved.reshape(*shape, 2) - at).astype(np.float32), visible.reshape(shape))


def _unhidden(surface: TrueSurface, eye: NDArray, points: NDArray) -> NDArray[np.bool_]:
    """(N,) whether nothing is between `eye` and each of the points (N, 3)."""
    known = np.isfinite(points).all(1)
    clear = np.zeros(len(points), np.bool_)
    to_points = points[known] - eye
    clear[known] = _cast(surface, eye, to_points)["t_hit"].numpy() > 1 - HIDDEN_SHARE
    return clear


def _cast(surface: TrueSurface, origin: NDArray, directions: NDArray) -> dict[str, o3d.core.Tensor]:
    """Open3D's answer to rays from one place."""
    origins = np.broadcast_to(origin, directions.shape)
    rays = np.concatenate([origins, directions], axis=-1).astype(np.float32)
    answer: dict[str, o3d.core.Tensor] = surface.scene.cast_rays(o3d.core.Tensor.from_numpy(rays))
    return answer

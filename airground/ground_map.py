"""The ground robot's map from RGB-D frames and their poses (Sec. IV)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from airground.config import GroundMapping
from airground.core.camera import PinholeCamera
from airground.core.cloud import PointCloud
from airground.core.messages import GroundImage
from airground.core.se3 import SE3
from airground.core.voxel_map import VoxelMap


class GroundMap:
    """Keyframes' depth images, averaged over small cubes in the frame `ground`.

    Args:
        camera: The RGB-D camera, as calibrated.
        config: When a frame becomes a keyframe, and how much of its depth to believe.
    """

    def __init__(self, camera: PinholeCamera, config: GroundMapping) -> None:
        self.keyframes = 0
        self._camera = camera
        self._rays = camera.rays().astype(np.float32)
        self._config = config
        self._voxels = VoxelMap(config.voxel_m)
        self._T_ground_keyframe: SE3 | None = None
        self._cloud: PointCloud | None = None

    def wants(self, T_ground_camera: SE3) -> bool:
        """Whether the camera moved or turned enough since the last keyframe."""
        if self._T_ground_keyframe is None:
            return True
        motion = self._T_ground_keyframe.inverse() @ T_ground_camera
        return (
            float(np.linalg.norm(motion.translation)) >= self._config.keyframe_distance_m
            or np.rad2deg(motion.angle()) >= self._config.keyframe_angle_deg
        )

    def add(self, image: GroundImage, T_ground_camera: SE3) -> None:
        """Take in a keyframe."""
        points_camera, colours, depth = self._points(image)
        # The noise of structured light grows with the square of depth (Nguyen et al. 2012).
        self._voxels.add(T_ground_camera @ points_camera, colours, depth**-4.0)
        self._T_ground_keyframe = T_ground_camera
        self.keyframes += 1
        self._cloud = None

    def cloud(self) -> PointCloud:
        """The map so far, one point a cube, in the frame `ground`."""
        if self._cloud is None:
            self._cloud = self._voxels.cloud(self._config.min_points)
        return self._cloud

    def _points(self, image: GroundImage) -> tuple[NDArray, NDArray, NDArray]:
        """Points (N, 3) in the camera, colours (N, 3) and depths (N,) [m] worth keeping."""
        depth = image.depth
        # NaN compares false, so missing depth drops out here.
        keep = (depth <= self._config.max_depth_m) & ~_near_silhouette(depth)
        points_camera = self._rays[keep] * depth[keep][:, None]
        return points_camera, image.colour[keep], depth[keep]


def _near_silhouette(depth: NDArray[np.float32]) -> NDArray[np.bool_]:
    """Pixels beside a jump in depth: there the sensor mixes fore- and background."""
    jump = np.zeros(depth.shape, bool)
    across = np.abs(np.diff(depth, axis=1)) > 0.05 * depth[:, 1:]
    down = np.abs(np.diff(depth, axis=0)) > 0.05 * depth[1:]
    jump[:, 1:] |= across
    jump[:, :-1] |= across
    jump[1:] |= down
    jump[:-1] |= down
    return jump

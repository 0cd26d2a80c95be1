"""The ground robot's map from RGB-D frames and their poses (Sec. IV).

Keyframes are fused in a truncated signed distance field, which averages the sensor's noise
along its rays. Averaging points in cubes does not: at 4 m the noise of structured light is
wider than a cube, and the highest of scattered points would enter the height map.
"""

from __future__ import annotations

import numpy as np
import open3d as o3d
from numpy.typing import NDArray

from airground.config import GroundMapping
from airground.core.camera import PinholeCamera
from airground.core.cloud import PointCloud
from airground.core.messages import GroundImage
from airground.core.se3 import SE3

_BLOCK = 8
_FIRST_BLOCKS = 10_000


class GroundMap:
    """Keyframes' depth images, fused in the frame `ground`.

    Args:
        camera: The RGB-D camera, as calibrated.
        config: When a frame becomes a keyframe, and how much of its depth to believe.
    """

    def __init__(self, camera: PinholeCamera, config: GroundMapping) -> None:
        self.keyframes = 0
        self._config = config
        self._intrinsics = o3d.core.Tensor.from_numpy(camera.matrix())
        self._grid = o3d.t.geometry.VoxelBlockGrid(
            attr_names=("tsdf", "weight", "color"),
            attr_dtypes=(o3d.core.float32,) * 3,
            attr_channels=[o3d.core.SizeVector([n]) for n in (1, 1, 3)],
            voxel_size=config.voxel_m,
            block_resolution=_BLOCK,
            block_count=_FIRST_BLOCKS,
        )
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
        usable = np.where(_near_silhouette(image.depth), np.nan, image.depth)
        depth = o3d.t.geometry.Image(o3d.core.Tensor.from_numpy(np.nan_to_num(usable)))
        colour = o3d.t.geometry.Image(o3d.core.Tensor.from_numpy(image.colour.astype(np.float32)))
        T_camera_ground = o3d.core.Tensor.from_numpy(T_ground_camera.inverse().matrix())
        reach = (1.0, self._config.max_depth_m, self._config.truncation_m / self._config.voxel_m)
        blocks = self._grid.compute_unique_block_coordinates(
            depth, self._intrinsics, T_camera_ground, *reach
        )
        self._grid.integrate(blocks, depth, colour, self._intrinsics, T_camera_ground, *reach)
        self._T_ground_keyframe = T_ground_camera
        self.keyframes += 1
        self._cloud = None

    def cloud(self) -> PointCloud:
        """The surface so far, with normals, in the frame `ground`."""
        if self._cloud is None:
            self._cloud = self._extracted()
        return self._cloud

    def _extracted(self) -> PointCloud:
        if self.keyframes == 0:
            return PointCloud.empty()
        extracted = self._grid.extract_point_cloud(self._config.min_keyframes - 0.5)
        if extracted.is_empty():
            return PointCloud.empty()
        points = extracted.point.positions.numpy()
        # Blocks come in the order of a parallel hash map, another each time.
        order = np.lexsort(points.T)
        colours = np.rint(extracted.point.colors.numpy()[order]).clip(0, 255)
        return PointCloud(
            points[order], colours.astype(np.uint8), extracted.point.normals.numpy()[order]
        )


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

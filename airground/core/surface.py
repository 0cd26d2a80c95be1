"""What the MAV reconstructs: a depth map, and the surface fused from several."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from airground.core.arrays import F32, U8, freeze
from airground.core.camera import PinholeCamera
from airground.core.cloud import PointCloud
from airground.core.se3 import SE3


@dataclass(frozen=True, eq=False)
class DepthMap:
    """Depth of one reference view, from many close views (Sec. V).

    Attributes:
        stamp_ns: Stamp of the reference view [ns].
        camera: Camera of the depth map (half resolution).
        T_mav_camera: Pose of the reference view in the MAV's map.
        depth: (height, width) float32 [m] along the optical axis, NaN where rejected.
        image: (height, width) uint8, the reference view at the same resolution.
        views: Number of views compared with the reference.
    """

    stamp_ns: int
    camera: PinholeCamera
    T_mav_camera: SE3
    depth: F32
    image: U8
    views: int

    def __post_init__(self) -> None:
        shape = (self.camera.height, self.camera.width)
        freeze(self, "depth", shape, np.float32)
        freeze(self, "image", shape, np.uint8)


@dataclass(frozen=True, eq=False)
class AerialSurface:
    """A surface fused from several depth maps and seen from a reference view (Sec. V).

    Attributes:
        stamp_ns: Stamp of the newest frame in the surface [ns].
        reference_stamp_ns: Stamp of the reference view [ns].
        camera: Camera of `depth`.
        T_mav_camera: Pose of the reference view in the MAV's map.
        depth: (height, width) float32 [m], NaN where nothing was fused.
        cloud_mav: Points of the surface in the MAV's map (grey colours, with normals).
        depth_maps: Number of fused depth maps.
    """

    stamp_ns: int
    reference_stamp_ns: int
    camera: PinholeCamera
    T_mav_camera: SE3
    depth: F32
    cloud_mav: PointCloud
    depth_maps: int

    def __post_init__(self) -> None:
        shape = (self.camera.height, self.camera.width)
        freeze(self, "depth", shape, np.float32)

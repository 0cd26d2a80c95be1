"""What the MAV saw, in two steps: one depth map, and the surface fused from several."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from airground.core.arrays import F32, U8, read_only
from airground.core.camera import PinholeCamera
from airground.core.cloud import PointCloud
from airground.core.se3 import SE3


@dataclass(frozen=True, eq=False)
class DepthMap:
    """Depth of one reference view, from many close views (Sec. V).

    Attributes:
        stamp_ns: Of the reference view.
        camera: The (half resolution) camera of the map.
        T_mav_camera: The reference view in the MAV's map.
        depth: (height, width) float32 [m] along the optical axis, NaN where rejected.
        image: (height, width) uint8, the reference view at the same resolution.
        views: How many views were compared with the reference.
    """

    stamp_ns: int
    camera: PinholeCamera
    T_mav_camera: SE3
    depth: F32
    image: U8
    views: int

    def __post_init__(self) -> None:
        shape = (self.camera.height, self.camera.width)
        object.__setattr__(self, "depth", read_only(self.depth, "depth", shape, np.float32))
        object.__setattr__(self, "image", read_only(self.image, "image", shape, np.uint8))


@dataclass(frozen=True, eq=False)
class AerialSurface:
    """A surface fused from several depth maps and seen from a reference view (Sec. V).

    Attributes:
        stamp_ns: Of the newest frame that went in: when the surface became known.
        reference_stamp_ns: Of the reference view.
        camera: The camera that `depth` was ray-cast for.
        T_mav_camera: The reference view in the MAV's map.
        depth: (height, width) float32 [m], NaN where nothing was fused.
        cloud_mav: The same points in the MAV's map (grey colours, with normals).
        depth_maps: How many depth maps went in.
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
        object.__setattr__(self, "depth", read_only(self.depth, "depth", shape, np.float32))

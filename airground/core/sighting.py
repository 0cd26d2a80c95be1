"""An aerial surface with both maps at its time: what localization and refinement start from."""

from __future__ import annotations

from dataclasses import dataclass

from airground.core.arrays import F64
from airground.core.cloud import PointCloud
from airground.core.se3 import SE3
from airground.core.surface import AerialSurface


@dataclass(frozen=True)
class Sighting:
    """All that locating one aerial surface needs; a snapshot of both maps at its time.

    Attributes:
        surface: Aerial surface of the MAV.
        ground_cloud: The ground robot's map at that time, in `ground`.
        T_mav_camera: Pose of the MAV's camera at `mav_stamp_ns`, when the surface was finished.
        T_ground_camera: Newest pose of the ground robot's camera, at `ground_stamp_ns`.
        heading: Turn of `mav` in `ground` by the magnetometers [rad], None if unknown.
        covariance_mav, covariance_ground: (6, 6) covariances of these poses: position [m] and
            rotation [rad], in the axes of `mav` and of `ground`; None where SLAM states none.
        ground_scale_sigma: Relative standard deviation of distances in the ground robot's map.
    """

    surface: AerialSurface
    ground_cloud: PointCloud
    mav_stamp_ns: int
    T_mav_camera: SE3
    ground_stamp_ns: int
    T_ground_camera: SE3
    heading: float | None
    covariance_mav: F64 | None = None
    covariance_ground: F64 | None = None
    ground_scale_sigma: float = 0.0

"""An aerial surface with both maps at its time: what localization and refinement start from."""

from __future__ import annotations

from dataclasses import dataclass

from airground.core.cloud import PointCloud
from airground.core.se3 import SE3
from airground.core.surface import AerialSurface


@dataclass(frozen=True)
class Sighting:
    """All that locating one aerial surface needs; a snapshot of both maps at its time.

    Attributes:
        surface: What the MAV saw.
        ground_cloud: The ground robot's map by then, in `ground`.
        T_mav_camera: The MAV's camera when the surface became known, at `mav_stamp_ns`.
        T_ground_camera: The ground robot's camera then, at `ground_stamp_ns`.
        heading: Turn of `mav` in `ground` by the magnetometers [rad], None if unknown.
    """

    surface: AerialSurface
    ground_cloud: PointCloud
    mav_stamp_ns: int
    T_mav_camera: SE3
    ground_stamp_ns: int
    T_ground_camera: SE3
    heading: float | None

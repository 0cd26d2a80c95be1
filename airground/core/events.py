"""What the pipeline reports, in the order in which it happens (Fig. 4).

A stage yields exactly one event when it is done. No event holds the truth."""

from __future__ import annotations

from dataclasses import dataclass

from airground.core.arrays import F64
from airground.core.belief import Alignment, Belief, CostMap, HeightMap
from airground.core.cloud import PointCloud, Source
from airground.core.se3 import SE3
from airground.core.sighting import Sighting
from airground.core.surface import AerialSurface, DepthMap


@dataclass(frozen=True)
class Event:
    """Something happened at `stamp_ns` (sensor time)."""

    stamp_ns: int


@dataclass(frozen=True, eq=False)
class MavTracked(Event):
    """The MAV's camera has a pose (Sec. IV).

    Attributes:
        T_mav_camera: Pose of the camera in the MAV's map.
        covariance: (6, 6) covariance of the pose's error in the map's axes: position [m], then
            rotation vector [rad]; None where the front end has none.
        scale_sigma: Relative standard deviation of the map's scale; None if not estimated.
    """

    T_mav_camera: SE3
    covariance: F64 | None = None
    scale_sigma: float | None = None


@dataclass(frozen=True, eq=False)
class GroundTracked(Event):
    """The ground robot's camera has a pose in its map (Sec. IV); attributes as of `MavTracked`."""

    T_ground_camera: SE3
    covariance: F64 | None = None
    scale_sigma: float | None = None


@dataclass(frozen=True)
class Initializing(Event):
    """A robot has no map to be in yet."""

    robot: Source


@dataclass(frozen=True)
class TrackingLost(Event):
    """A robot has a map and does not know where it is."""

    robot: Source


@dataclass(frozen=True)
class PosesCorrected(Event):
    """A robot's map changed, and its earlier poses with it."""

    robot: Source


@dataclass(frozen=True)
class GroundMapExtended(Event):
    """A keyframe of the ground robot joined its map."""

    keyframes: int


@dataclass(frozen=True)
class FrameAdded(Event):
    """One view joined the depth map under construction (Sec. V)."""

    reference_stamp_ns: int


@dataclass(frozen=True)
class DepthMapMade(Event):
    """A depth map was aggregated, refined and freed of what is uncertain (Sec. V)."""

    depth_map: DepthMap


@dataclass(frozen=True)
class FieldAdded(Event):
    """The depth map of a reference view went into the histogram of distance fields (Sec. V)."""

    reference_stamp_ns: int


@dataclass(frozen=True)
class VolumeFused(Event):
    """The distance fields were fused (Eq. 1)."""


@dataclass(frozen=True)
class SurfaceCast(Event):
    """The fused surface was ray-cast into a point cloud (Sec. V)."""

    surface: AerialSurface


@dataclass(frozen=True)
class Sighted(Event):
    """Both robots knew their poses when the surface was cast, so that it can be located."""

    sighting: Sighting


@dataclass(frozen=True)
class NotLocated(Event):
    """An aerial surface cannot be located; `reason` says why, after the kind and a colon."""

    reason: str


@dataclass(frozen=True)
class HeightMapsMade(Event):
    """Both maps were projected to the ground plane (Sec. VI-A, Fig. 7a and b)."""

    aerial: HeightMap
    ground: HeightMap


@dataclass(frozen=True)
class CostMapComputed(Event):
    """Every position in the search region has a cost (Eq. 2, Fig. 7c)."""

    cost_map: CostMap


@dataclass(frozen=True)
class BeliefUpdated(Event):
    """The particles took in one aerial surface (Sec. VI-B)."""

    belief: Belief


@dataclass(frozen=True)
class Aligned(Event):
    """The clouds were aligned by ICP, or the alignment was refused (Sec. VII)."""

    alignment: Alignment


@dataclass(frozen=True)
class MapAugmented(Event):
    """The aerial surface joined the ground map; `cloud_ground` is what it added."""

    cloud_ground: PointCloud

"""The poses that a front end has given, for one that never corrects them."""

from __future__ import annotations

from airground.core.se3 import SE3
from airground.core.trajectory import Trajectory
from airground.slam.front_end import TrackedPose, Tracking


class PoseLog:
    """Collects tracked poses in order of time."""

    def __init__(self) -> None:
        self._stamps: list[int] = []
        self._poses: list[SE3] = []

    def tracked(self, stamp_ns: int, T_map_camera: SE3) -> TrackedPose:
        """Note a pose, and return it as a front end does."""
        self._stamps.append(stamp_ns)
        self._poses.append(T_map_camera)
        return TrackedPose(stamp_ns, Tracking.TRACKED, T_map_camera)

    def trajectory(self) -> Trajectory | None:
        """Every pose noted; None before the first."""
        return Trajectory.from_poses(self._stamps, self._poses) if self._poses else None

"""A map of the ground that somebody else made."""

from __future__ import annotations

from airground.core.cloud import PointCloud
from airground.core.messages import GroundImage
from airground.core.se3 import SE3
from airground.core.trajectory import Trajectory


class FixedMap:
    """Stands in for a `GroundMap`, and stays as it is.

    Args:
        cloud: In the frame `ground`, in which the ground robot's poses are, too.
    """

    keyframes = 0

    def __init__(self, cloud: PointCloud) -> None:
        self._cloud = cloud

    def wants(self, T_ground_camera: SE3) -> bool:
        """It wants no keyframe."""
        return False

    def add(self, image: GroundImage, T_ground_camera: SE3) -> None:
        """Nothing can be added."""
        raise TypeError("a fixed map takes no keyframes")

    def follow(self, trajectory: Trajectory) -> bool:
        """It follows no correction."""
        return False

    def cloud(self) -> PointCloud:
        """All of it."""
        return self._cloud

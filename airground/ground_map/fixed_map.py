"""A map of the ground from an external source."""

from __future__ import annotations

from airground.core.cloud import PointCloud
from airground.core.messages import GroundImage
from airground.core.se3 import SE3
from airground.core.trajectory import Trajectory


class FixedMap:
    """Takes the place of a `GroundMap` and never changes.

    Args:
        cloud: Cloud in the frame `ground`, in which the ground robot's poses are given.
    """

    keyframes = 0

    def __init__(self, cloud: PointCloud) -> None:
        self._cloud = cloud

    def wants(self, T_ground_camera: SE3) -> bool:
        """Never: the map takes no keyframe."""
        return False

    def add(self, image: GroundImage, T_ground_camera: SE3) -> None:
        """Raises TypeError: the map takes no keyframe."""
        raise TypeError("a fixed map takes no keyframes")

    def follow(self, trajectory: Trajectory) -> bool:
        """Never: the map follows no correction."""
        return False

    def cloud(self) -> PointCloud:
        """The whole map."""
        return self._cloud

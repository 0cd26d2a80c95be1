"""What a user brings along in place of a stage: trajectories, and a map of the ground."""

from __future__ import annotations

from dataclasses import dataclass

from airground.core.cloud import PointCloud
from airground.core.trajectory import Trajectory


@dataclass(frozen=True, eq=False)
class Given:
    """Results of other systems; None where ours do the work.

    Attributes:
        mav, ground: Poses `T_map_camera`, metric with z up.
        ground_map: In the frame of the ground robot's poses.
    """

    mav: Trajectory | None = None
    ground: Trajectory | None = None
    ground_map: PointCloud | None = None

    def robots(self) -> frozenset[str]:
        """Those of "mav" and "ground" whose poses are given."""
        poses = {"mav": self.mav, "ground": self.ground}
        return frozenset(robot for robot, given in poses.items() if given is not None)

    def describe(self) -> str:
        """How results name what was replaced; empty where nothing was."""
        parts = {"MAV poses": self.mav, "ground poses": self.ground, "ground map": self.ground_map}
        names = [name for name, given in parts.items() if given is not None]
        return f"{', '.join(names)} from a file" if names else ""


NOTHING = Given()

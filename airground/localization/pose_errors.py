"""What errors of both robots' poses do to a position that was found by laying maps over each other.

Maps are laid over each other upright, and by what lies on the floor. A vertical that is off leans
the line from the floor up to the MAV's camera, so that particles agree on a place beside the true
one. A depth camera whose scale is off puts all of the ground robot's map too far from the robot, or
too near. Particles cannot show either themselves."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from airground.core.arrays import F64, freeze
from airground.core.se3 import SE3


@dataclass(frozen=True, eq=False)
class PoseErrors:
    """How well both robots' rotations, and the scale of the ground robot's map, were known when a
    surface was finished.

    Positions do not count: the aerial surface moves with the MAV's camera, and the ground map
    around the ground robot has drifted as the robot itself.

    Attributes:
        lever_mav: (3,) from the middle of the aerial surface to the MAV's camera, in `mav` [m].
        turns_mav, turns_ground: (3, 3) covariance of a camera's rotation [rad^2], in the axes of
            `mav` and of `ground`.
        ground_robot: (3,) position of the ground robot's camera in `ground` [m].
        ground_scale: Relative standard deviation of distances in the ground robot's map.
    """

    lever_mav: F64
    turns_mav: F64
    turns_ground: F64
    ground_robot: F64
    ground_scale: float

    def __post_init__(self) -> None:
        for name in ("lever_mav", "ground_robot"):
            freeze(self, name, (3,), np.float64)
        for name in ("turns_mav", "turns_ground"):
            freeze(self, name, (3, 3), np.float64)

    @classmethod
    def none(cls) -> PoseErrors:
        """Poses without an error."""
        return cls(np.zeros(3), np.zeros((3, 3)), np.zeros((3, 3)), np.zeros(3), 0.0)

    def covariance(self, estimate: F64) -> F64:
        """(2, 2) covariance of the camera's x and y in `ground` [m^2], relative to the ground
        robot, if the MAV's camera is at x, y [m] and `mav` is turned by a heading [rad]."""
        turn = SE3.from_heading(float(estimate[2])).rotation
        leaning = _leaning(turn @ self.lever_mav)
        turns = turn @ self.turns_mav @ turn.T + self.turns_ground
        by_turns = (leaning @ turns @ leaning.T)[:2, :2]
        by_scale = self.ground_scale * (estimate[:2] - self.ground_robot[:2])
        total: F64 = by_turns + np.outer(by_scale, by_scale)
        return total


def _leaning(lever: F64) -> F64:
    """(3, 3) how the end of a lever moves with a small rotation of it."""
    x, y, z = lever
    return np.array([[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]])

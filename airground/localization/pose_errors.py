"""What errors of both robots' poses do to a position that was found by laying maps over each other.

Maps are laid over each other upright, and by what lies on the floor. A vertical that is off leans
the line from the floor up to the MAV's camera, so that particles agree on a place beside the true
one; they cannot show it themselves."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from airground.core.arrays import F64, freeze
from airground.core.se3 import SE3


@dataclass(frozen=True, eq=False)
class PoseErrors:
    """How well both robots' rotations were known when a surface was finished, as SLAM states it.

    Positions do not count: the aerial surface moves with the MAV's camera, and the ground map
    around the ground robot has drifted as the robot itself.

    Attributes:
        lever_mav: (3,) from the middle of the aerial surface to the MAV's camera, in `mav` [m].
        turns_mav, turns_ground: (3, 3) covariance of a camera's rotation [rad^2], in the axes of
            `mav` and of `ground`.
    """

    lever_mav: F64
    turns_mav: F64
    turns_ground: F64

    def __post_init__(self) -> None:
        for name, shape in (("lever_mav", (3,)), ("turns_mav", (3, 3)), ("turns_ground", (3, 3))):
            freeze(self, name, shape, np.float64)

    @classmethod
    def none(cls) -> PoseErrors:
        """Poses without an error."""
        return cls(np.zeros(3), np.zeros((3, 3)), np.zeros((3, 3)))

    def covariance(self, heading: float) -> F64:
        """(2, 2) covariance of the camera's x and y in `ground` [m^2], with `mav` turned by a
        heading [rad]."""
        turn = SE3.from_heading(heading).rotation
        leaning = _leaning(turn @ self.lever_mav)
        turns = turn @ self.turns_mav @ turn.T + self.turns_ground
        total: F64 = leaning @ turns @ leaning.T
        return total[:2, :2]


def _leaning(lever: F64) -> F64:
    """(3, 3) how the end of a lever moves with a small rotation of it."""
    x, y, z = lever
    return np.array([[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]])

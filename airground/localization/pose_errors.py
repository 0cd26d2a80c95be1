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
    """Covariances of the robots' poses when a surface was finished, as their SLAM states them.

    Attributes:
        lever_mav: (3,) from the middle of the aerial surface to the MAV's camera, in `mav` [m].
        of_mav, of_ground: (6, 6) covariance of a camera's position [m] and rotation [rad], in the
            axes of `mav` and of `ground`.
    """

    lever_mav: F64
    of_mav: F64
    of_ground: F64

    def __post_init__(self) -> None:
        for name, shape in (("lever_mav", (3,)), ("of_mav", (6, 6)), ("of_ground", (6, 6))):
            freeze(self, name, shape, np.float64)

    @classmethod
    def none(cls) -> PoseErrors:
        """Poses without an error."""
        return cls(np.zeros(3), np.zeros((6, 6)), np.zeros((6, 6)))

    def covariance(self, heading: float) -> F64:
        """(2, 2) covariance of the camera's x and y in `ground` [m^2], with `mav` turned by a
        heading [rad]."""
        turn = SE3.from_heading(heading).rotation
        leaning = _leaning(turn @ self.lever_mav)
        # The surface moves with the MAV's camera: of its pose only the rotation counts.
        rotation = turn @ self.of_mav[3:, 3:] @ turn.T
        # The newest pose of the ground robot is off against its map, which is older.
        moved = np.hstack([np.eye(3), leaning])
        total: F64 = leaning @ rotation @ leaning.T + moved @ self.of_ground @ moved.T
        return total[:2, :2]


def _leaning(lever: F64) -> F64:
    """(3, 3) how the end of a lever moves with a small rotation of it."""
    x, y, z = lever
    return np.array([[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]])

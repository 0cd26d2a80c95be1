"""What one try needs: an aerial surface, and the ground map over which it is laid."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from airground.core.se3 import SE3

Points = NDArray[np.float32]


@dataclass(frozen=True, eq=False)
class View:
    """An aerial surface over a ground map.

    Attributes:
        aerial: (N, 3) points of the surface in `mav` [m].
        camera: (3,) the surface's reference camera in `mav` [m].
        ground: (M, 3) points of the ground map in `ground` [m].
        robot: (2,) the ground robot, the middle of the searched region, in `ground` [m].
        heading: Turn of `mav` in `ground` by the magnetometers [rad].
        T_ground_mav: The true motion; None where the surface has no place in the map.
    """

    aerial: Points
    camera: NDArray[np.float64]
    ground: Points
    robot: NDArray[np.float64]
    heading: float
    T_ground_mav: SE3 | None

    def without_place(self) -> View:
        """The same, with any claim counted as wrong."""
        return replace(self, T_ground_mav=None)

    def over(self, other: View) -> View:
        """This surface over the map of another view."""
        return replace(self, ground=other.ground, robot=other.robot, T_ground_mav=None)

    def turned(self, angle: float) -> View:
        """The heading of the magnetometers off by an angle [rad], in a map without a place."""
        return replace(self, heading=self.heading + angle, T_ground_mav=None)

    def mirrored(self) -> View:
        """Over the mirror image of its ground map."""
        flip = np.array([-1.0, 1.0, 1.0])
        ground = (self.ground * flip).astype(np.float32)
        return replace(self, ground=ground, robot=self.robot * flip[:2], T_ground_mav=None)

    def cut(
        self, left: float, where: Callable[[Points], NDArray], earlier: Sequence[View] = ()
    ) -> View:
        """Over the part of its map beyond a line that leaves a share of the surface over it, and of
        that joined with those before it.

        Args:
            left: Share of the surface's points that stay over the map.
            where: Distance of points in `ground` along the direction away from the surface [m].
            earlier: The views before it in the flight.
        """
        assert self.T_ground_mav is not None
        surfaces = [self.T_ground_mav @ view.aerial for view in (*earlier, self)]
        joined = [np.concatenate(surfaces[k:]).astype(np.float32) for k in range(len(surfaces))]
        edge = max(np.quantile(where(aerial), 1 - left) for aerial in joined)
        kept = self.ground[where(self.ground) > edge]
        return replace(self, ground=kept, T_ground_mav=None)


@dataclass(frozen=True, eq=False)
class Flown:
    """The surfaces of one flight, in order, each over the map of its own ground robot."""

    name: str
    views: tuple[View, ...]

    @property
    def map(self) -> View:
        """The view with the last, and largest, ground map."""
        return self.views[-1]

"""A cuboid where it lies: a cardboard box, a slab, a board of a shelf."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from airground.core.arrays import read_only
from airground.core.se3 import SE3
from sim.geometry.parts import Kind
from sim.geometry.surface import BOX_CORNERS


@dataclass(frozen=True, eq=False)
class Box:
    """A cuboid at rest.

    Attributes:
        name: Unique, `box_000` and so on.
        make: Index of its make; boxes of a make share size, board and print.
        size_m: (3,) full edge lengths along its own axes [m]; z is up when it stands.
        T_world_box: Pose of its centre.
        kind: Class of the thing, which decides what is painted on it: "box" is cardboard.
    """

    name: str
    make: int
    size_m: NDArray[np.float64]
    T_world_box: SE3
    kind: Kind = "box"

    def __post_init__(self) -> None:
        object.__setattr__(self, "size_m", read_only(self.size_m, "size_m", (3,), np.float64))

    def corners(self) -> NDArray[np.float64]:
        """(8, 3) corners in `world` [m]."""
        return self.T_world_box @ (BOX_CORNERS * self.size_m / 2)

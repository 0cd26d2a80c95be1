"""A point cloud, and the robot that saw each point."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

import numpy as np

from airground.core.arrays import F32, U8, freeze


class Source(IntEnum):
    """The robot that saw a point."""

    GROUND = 0
    MAV = 1


@dataclass(frozen=True, eq=False)
class PointCloud:
    """Points with colour, and where known with normals.

    Attributes:
        points: (N, 3) float32 [m], all finite.
        colours: (N, 3) uint8 RGB; grey points repeat their value.
        normals: (N, 3) float32 unit vectors, or None where not computed.
    """

    points: F32
    colours: U8
    normals: F32 | None = None

    def __post_init__(self) -> None:
        freeze(self, "points", (None, 3), np.float32)
        if not np.isfinite(self.points).all():
            raise ValueError("points: every coordinate must be finite")
        freeze(self, "colours", (len(self), 3), np.uint8)
        if self.normals is not None:
            freeze(self, "normals", (len(self), 3), np.float32)

    def __len__(self) -> int:
        return len(self.points)

    @classmethod
    def empty(cls) -> PointCloud:
        return cls(np.zeros((0, 3), np.float32), np.zeros((0, 3), np.uint8))

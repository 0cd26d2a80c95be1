"""The magnetic field in a room: the Earth's, bent by iron in the floor and the walls.

Iron is a handful of magnetic dipoles outside the space where robots move, so that the
anomaly obeys Maxwell's equations there (no divergence, no curl) and varies over metres.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from airground.core.arrays import read_only

# Central Europe (WMM, about 47.4 N 8.5 E), declination left out: magnetic north is world +x.
EARTH_FIELD_WORLD = np.array([21.5e-6, 0.0, -43.0e-6])
ANOMALY_T = 0.5e-6  # horizontal RMS over the room: bends the heading by about 1 degree
DIPOLES = 8
_DEPTH_M = (0.9, 1.6)
_MU0_OVER_4PI = 1e-7


@dataclass(frozen=True, eq=False)
class MagneticField:
    """The Earth's field and the anomaly of a room.

    Attributes:
        positions: (K, 3) positions of the dipoles in `world` [m].
        moments: (K, 3) moments of the dipoles [A m^2].
    """

    positions: NDArray[np.float64]
    moments: NDArray[np.float64]

    def __post_init__(self) -> None:
        positions = read_only(self.positions, "positions", (None, 3), np.float64)
        object.__setattr__(self, "positions", positions)
        moments = read_only(self.moments, "moments", (len(positions), 3), np.float64)
        object.__setattr__(self, "moments", moments)

    def anomaly(self, points_world: ArrayLike) -> NDArray[np.float64]:
        """(N, 3) field of the dipoles alone [T] at (N, 3) points, in `world`."""
        points = np.asarray(points_world, np.float64)
        total = np.zeros_like(points)
        for position, moment in zip(self.positions, self.moments, strict=True):
            arm = points - position
            distance = np.linalg.norm(arm, axis=1, keepdims=True)
            along = (arm @ moment)[:, None]
            total += _MU0_OVER_4PI * (3 * along * arm / distance**5 - moment / distance**3)
        return total

    def at(self, points_world: ArrayLike) -> NDArray[np.float64]:
        """(N, 3) whole field [T] at (N, 3) points, in `world`."""
        return EARTH_FIELD_WORLD + self.anomaly(points_world)


def room_field(
    rng: np.random.Generator, low: ArrayLike, high: ArrayLike, floor: float
) -> MagneticField:
    """A field with iron under the floor of a rectangle.

    Args:
        rng: Source of randomness.
        low, high: (2,) corners of the rectangle where the robots move [m].
        floor: Height of its floor [m].

    Returns:
        Dipoles scaled so that the horizontal anomaly 1 m above the floor is `ANOMALY_T` RMS.
    """
    low, high = np.asarray(low, np.float64), np.asarray(high, np.float64)
    horizontal = rng.uniform(low - 0.5, high + 0.5, (DIPOLES, 2))
    depth = rng.uniform(*_DEPTH_M, (DIPOLES, 1))
    positions = np.hstack([horizontal, floor - depth])
    field = MagneticField(positions, rng.standard_normal((DIPOLES, 3)))
    axes = [np.linspace(lo, hi, 12) for lo, hi in zip(low, high, strict=True)]
    grid = np.stack(np.meshgrid(*axes, [floor + 1.0], indexing="ij"), axis=-1).reshape(-1, 3)
    rms = np.sqrt(np.mean(np.sum(field.anomaly(grid)[:, :2] ** 2, axis=1)))
    return MagneticField(positions, field.moments * (ANOMALY_T / rms))

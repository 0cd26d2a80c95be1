"""A street along x: pavements with kerbs, and the fronts of houses, on both sides of the road."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from airground.core.se3 import SE3
from sim.geometry.box import Box
from sim.geometry.parts import Kind
from sim.scene import Scene, Street

PAVING_M = 3.0
"""Greatest length of a piece of pavement [m]."""
HOUSE_M = 7.5
"""Greatest width of a house [m]."""
FRONT_M = 0.3
"""Thickness of the fronts, behind which nothing stands [m]."""
_HEIGHTS = (0.75, 1.0)
"""Least and greatest height of a house as a share of the street's."""


def lay_street(scene: Scene, rng: np.random.Generator) -> tuple[Box, ...]:
    """Pavements and fronts of `scene.street`, mirrored but for the houses' heights."""
    street = scene.street
    if street is None:
        return ()
    length, width = scene.room.size_m
    return (*_pavements(street, length, width), *_fronts(street, length, width, rng))


def _pavements(street: Street, length: float, width: float) -> Iterator[Box]:
    y = width / 2 - street.pavement_m / 2
    pieces = int(np.ceil(length / PAVING_M))
    size = [length / pieces, street.pavement_m, street.kerb_m]
    for number, (side, piece) in enumerate(np.ndindex(2, pieces)):
        x = (piece + 0.5) * size[0] - length / 2
        yield _standing(f"pavement_{number:03d}", "pavement", size, x, (2 * side - 1) * y, 0.0)


def _fronts(street: Street, length: float, width: float, rng: np.random.Generator) -> Iterator[Box]:
    if street.houses_m == 0:
        return
    houses = int(np.ceil(length / HOUSE_M))
    y = width / 2 - FRONT_M / 2
    for number, (side, house) in enumerate(np.ndindex(2, houses)):
        size = [length / houses, FRONT_M, street.houses_m * rng.uniform(*_HEIGHTS)]
        x = (house + 0.5) * size[0] - length / 2
        name = f"front_{number:03d}"
        yield _standing(name, "front", size, x, (2 * side - 1) * y, street.kerb_m)


def _standing(name: str, kind: Kind, size: list[float], x: float, y: float, z: float) -> Box:
    """An upright cuboid that stands at a height z."""
    centre = np.array([x, y, z + size[2] / 2])
    return Box(name, 0, np.array(size), SE3(np.eye(3), centre), kind)

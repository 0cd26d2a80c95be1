"""Shapes of bodies that move: a person and a robot, of closed surfaces in one colour each."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from airground.core.se3 import SE3
from sim.geometry.surface import Mesh, box_mesh, join

PERSON_M = 1.75
ROBOT_M = 0.8
"""Heights [m]."""
_SEGMENTS = 14
_SKIN, _SHIRT, _TROUSERS, _SHOES = (198, 152, 124), (206, 92, 44), (44, 52, 78), (40, 38, 38)
_CHASSIS, _WHEEL, _SENSOR = (226, 178, 36), (38, 38, 40), (70, 74, 80)
Colour = tuple[int, int, int]


@dataclass(frozen=True, eq=False)
class Piece:
    """A closed surface in the body's frame: x forward, z up, the origin on the floor.

    Attributes:
        mesh: Its vertices [m] and triangles.
        colour: Display colour in full light, 0 to 255 RGB.
    """

    mesh: Mesh
    colour: Colour


def body_pieces(shape: str, height_m: float | None = None) -> list[Piece]:
    """Pieces of a "person" or a "robot"; a robot's mast ends at its height [m]."""
    if shape == "person":
        return _person((height_m or PERSON_M) / PERSON_M)
    return _robot(height_m or ROBOT_M)


def body_mesh(pieces: list[Piece]) -> Mesh:
    """One mesh of all pieces, in their order."""
    return join(piece.mesh for piece in pieces)


def _person(scale: float) -> list[Piece]:
    """Legs in mid-step, a torso, arms and a head."""
    legs = join(
        _tube([0.07, 0.085, 0.1], [0.05, 0.45, 0.86], [0, side * 0.1, 0], lean_x=side * 0.12)
        for side in (-1, 1)
    )
    shoes = join(
        box_mesh(np.array([0.27, 0.1, 0.08]), _at(0.04 - side * 0.1, side * 0.1, 0.04))
        for side in (-1, 1)
    )
    torso = _tube([0.15, 0.165, 0.19, 0.13, 0.06], [0.8, 1.05, 1.32, 1.44, 1.5], flat=0.62)
    arms = join(
        _tube([0.04, 0.045, 0.055], [0.78, 1.08, 1.42], [0, side * 0.235, 0], lean_x=-side * 0.1)
        for side in (-1, 1)
    )
    head = _tube([0.05, 0.09, 0.105, 0.09, 0.04], [1.48, 1.56, 1.64, 1.71, 1.75])
    pieces = [
        Piece(legs, _TROUSERS),
        Piece(shoes, _SHOES),
        Piece(join([torso, arms]), _SHIRT),
        Piece(head, _SKIN),
    ]
    return [Piece((p.mesh[0] * scale, p.mesh[1]), p.colour) for p in pieces]


def _robot(height_m: float) -> list[Piece]:
    """A chassis on four wheels, and a mast with a sensor bar."""
    chassis = box_mesh(np.array([0.56, 0.36, 0.16]), _at(0, 0, 0.2))
    wheels = join(
        box_mesh(np.array([0.17, 0.07, 0.17]), _at(x * 0.19, y * 0.22, 0.085))
        for x in (-1, 1)
        for y in (-1, 1)
    )
    top = max(height_m, 0.4)
    mast = box_mesh(np.array([0.05, 0.05, top - 0.28]), _at(0.05, 0, (top + 0.28) / 2))
    bar = box_mesh(np.array([0.07, 0.28, 0.06]), _at(0.08, 0, top - 0.03))
    return [
        Piece(chassis, _CHASSIS),
        Piece(wheels, _WHEEL),
        Piece(join([mast, bar]), _SENSOR),
    ]


def _at(x: float, y: float, z: float) -> SE3:
    return SE3(np.eye(3), np.array([x, y, z]))


def _tube(
    radii: ArrayLike,
    heights: ArrayLike,
    foot: ArrayLike = (0, 0, 0),
    flat: float = 1.0,
    lean_x: float = 0.0,
) -> Mesh:
    """A closed surface of elliptic rings.

    Args:
        radii: (K,) half widths along y at the heights [m].
        heights: (K,) increasing [m].
        foot: Where its axis stands [m].
        flat: Half width along x as a share of that along y.
        lean_x: How far the lowest ring lies behind the highest along x [m].
    """
    radius, z = np.asarray(radii, np.float64), np.asarray(heights, np.float64)
    angle = np.arange(_SEGMENTS) / _SEGMENTS * 2 * np.pi
    shift = lean_x * (z - z[-1]) / (z[-1] - z[0])
    rings = np.stack(
        np.broadcast_arrays(
            flat * radius[:, None] * np.cos(angle) + shift[:, None],
            radius[:, None] * np.sin(angle),
            z[:, None],
        ),
        axis=-1,
    )
    ends = np.array([[shift[0], 0, z[0]], [shift[-1], 0, z[-1]]])
    vertices = np.concatenate([rings.reshape(-1, 3), ends]) + np.asarray(foot, np.float64)
    return vertices, _tube_triangles(len(radius))


def _tube_triangles(rings: int) -> NDArray[np.int64]:
    """Sides and both ends, counter-clockwise seen from outside."""
    here = np.arange(_SEGMENTS)
    after = (here + 1) % _SEGMENTS
    faces = []
    for ring in range(rings - 1):
        low, high = ring * _SEGMENTS, (ring + 1) * _SEGMENTS
        faces.append(np.stack([low + here, low + after, high + after], axis=1))
        faces.append(np.stack([low + here, high + after, high + here], axis=1))
    bottom, top, last = rings * _SEGMENTS, rings * _SEGMENTS + 1, (rings - 1) * _SEGMENTS
    faces.append(np.stack([np.full(_SEGMENTS, bottom), after, here], axis=1))
    faces.append(np.stack([np.full(_SEGMENTS, top), last + here, last + after], axis=1))
    return np.concatenate(faces)

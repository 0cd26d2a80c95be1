"""Racks of shelves with boxes: rows of the same bay, again and again."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import ArrayLike

from airground.core.se3 import SE3
from airground.errors import InputError
from sim.geometry.box import Box
from sim.geometry.lane import distance_to_footprint, lane_points
from sim.geometry.parts import Kind
from sim.scene import Scene, Shelves
from sim.scene.things import FOOT_M

POST_M = 0.06
"""Edge of a post [m]."""
BOARD_M = 0.03
"""Thickness of a board [m]."""
CLEARANCE_M = 0.35
"""Least distance from the ground robot's path to a rack [m]: its radius and a hand's width."""


def stand_shelves(scene: Scene, rng: np.random.Generator) -> tuple[Box, ...]:
    """Posts, boards and boxes of `scene.shelves`, centred on the origin.

    Every bay is exactly like the one before it, but for the places that `empty` leaves free.

    Raises:
        InputError: The racks reach beyond the floor, or stand in the ground robot's path.
    """
    shelves = scene.shelves
    if shelves is None:
        return ()
    _check_room(scene, shelves)
    boxes = [*_racks(shelves), *_goods(shelves, rng)]
    lane = lane_points(scene)
    for box in boxes:
        if distance_to_footprint(lane, box.corners()) < CLEARANCE_M:
            x, y = box.T_world_box.translation[:2]
            raise InputError(
                f"scene '{scene.name}': ground.waypoints pass closer than {CLEARANCE_M} m to the "
                f"rack at [{x:.2f}, {y:.2f}]"
            )
    return tuple(boxes)


def _check_room(scene: Scene, shelves: Shelves) -> None:
    bay, row = shelves.period_m
    if shelves.depth_m >= row:
        raise InputError(f"scene '{scene.name}': shelves.depth_m must be below period_m[1] = {row}")
    reach = (shelves.bays * bay + POST_M, (shelves.rows - 1) * row + shelves.depth_m)
    for axis, have, room in zip("xy", reach, scene.room.size_m, strict=True):
        if have > room:
            raise InputError(
                f"scene '{scene.name}': the shelves are {have:g} m long along {axis}, "
                f"room.size_m is {room:g}"
            )


def _racks(shelves: Shelves) -> Iterator[Box]:
    """Posts at the ends of every bay, front and back, and the boards between them."""
    bay, row = shelves.period_m
    tall = FOOT_M + (shelves.levels - 1) * shelves.level_m + 0.06
    count = 0
    for y in _centred(shelves.rows) * row:
        for x in _centred(shelves.bays + 1) * bay:
            for side in (-1, 1):
                place = [x, y + side * (shelves.depth_m - POST_M) / 2, tall / 2]
                yield _cuboid(f"post_{count:03d}", "post", [POST_M, POST_M, tall], place)
                count += 1
    for count, (x, y, z) in enumerate(_boards(shelves)):
        size = [bay - POST_M, shelves.depth_m, BOARD_M]
        yield _cuboid(f"board_{count:03d}", "board", size, [x, y, z])


def _boards(shelves: Shelves) -> Iterator[tuple[float, float, float]]:
    """Centres of all boards [m]."""
    bay, row = shelves.period_m
    for y in _centred(shelves.rows) * row:
        for x in _centred(shelves.bays) * bay:
            for level in range(shelves.levels):
                yield float(x), float(y), FOOT_M + level * shelves.level_m


def _goods(shelves: Shelves, rng: np.random.Generator) -> Iterator[Box]:
    """Boxes side by side on every board, the same distance from each other all along a row."""
    step = shelves.period_m[0] / max(shelves.boxes_per_bay, 1)
    size, count = np.array(shelves.box_m), 0
    for x, y, z in _boards(shelves):
        for shift in _centred(shelves.boxes_per_bay) * step:
            if rng.random() < shelves.empty:
                continue
            place = [x + shift, y, z + (BOARD_M + size[2]) / 2]
            yield _cuboid(f"goods_{count:03d}", "box", size, place)
            count += 1


def _cuboid(name: str, kind: Kind, size_m: ArrayLike, centre: ArrayLike) -> Box:
    place = np.asarray(centre, np.float64)
    return Box(name, 0, np.asarray(size_m, np.float64), SE3(np.eye(3), place), kind)


def _centred(count: int) -> np.ndarray:
    """(count,) numbers one apart around 0."""
    return np.arange(count) - (count - 1) / 2

"""Piles of boxes that a ray tracer sees: twins, rows of identical boxes, piles that change."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from airground.core.se3 import SE3
from tests.localization.synthetic import (
    CORRIDOR_M,
    Box,
    Heap,
    aerial_points,
    ground_points,
    pile_up,
    random_boxes,
)
from tests.negatives.views import View

BOXES = 80
CHANGED = 0.3
"""Share of the boxes that lie elsewhere when the MAV comes, as in level `extreme` 1."""
STEP_M = 0.3
"""Distance that the MAV flies from one aerial map to the next [m]."""
HEIGHT_M = 2.2
FRAMES = 30
"""Depth images of the ground robot's drive."""
LEFT = 0.1
"""Share of an aerial map that lies over the ground map where its place was cut away."""


def same(rng: np.random.Generator, maps: int) -> list[View]:
    """Over the pile that the ground robot saw."""
    pile = pile_up(random_boxes(rng, BOXES))
    return fly(pile, pile, rng, maps)


def twins(rng: np.random.Generator, maps: int) -> list[View]:
    """Over a pile of the same boxes in another arrangement."""
    boxes = random_boxes(rng, BOXES)
    moved = _elsewhere(boxes, np.arange(BOXES), rng)
    return [v.without_place() for v in fly(pile_up(boxes), pile_up(moved), rng, maps)]


def changed(rng: np.random.Generator, maps: int) -> list[View]:
    """Over a pile of which some boxes lie elsewhere since; the place is there."""
    boxes = random_boxes(rng, BOXES)
    chosen = rng.choice(BOXES, round(CHANGED * BOXES), replace=False)
    return fly(pile_up(_elsewhere(boxes, chosen, rng)), pile_up(boxes), rng, maps)


def rows(rng: np.random.Generator, maps: int) -> list[View]:
    """Over rows of identical boxes; each place looks like those one period away."""
    heap = _rows(rng)
    return fly(heap, heap, rng, maps)


def rows_moved(rng: np.random.Generator, maps: int) -> list[View]:
    """The same, where the ground map ends before the true place, and holds others like it."""
    heap = _rows(rng)
    views = fly(heap, heap, rng, maps)
    sign = 1.0 if views[0].camera[0] > views[0].robot[0] else -1.0
    return [
        view.cut(LEFT, lambda points: -sign * points[:, 0], views[:k])
        for k, view in enumerate(views)
    ]


def fly(flown: Heap, driven: Heap, rng: np.random.Generator, maps: int) -> list[View]:
    """Aerial maps along a straight flight over one pile, with the ground map of another."""
    ground = ground_points(driven, rng, frames=FRAMES)
    (x, y), way = rng.uniform((-1.2, -0.4), (1.2, 0.4)), rng.uniform(0, 2 * np.pi)
    heading = rng.uniform(-np.pi, np.pi)
    T_ground_mav = SE3.from_heading(heading)
    views = []
    for k in range(maps):
        place = x + k * STEP_M * np.cos(way), y + k * STEP_M * np.sin(way)
        points = aerial_points(flown, *place, rng)
        camera = T_ground_mav.inverse() @ np.array([*place, HEIGHT_M])
        aerial = (T_ground_mav.inverse() @ points).astype(np.float32)
        views.append(View(aerial, camera, ground, np.zeros(2), heading, T_ground_mav))
    return views


def _elsewhere(boxes: list[Box], which: np.ndarray, rng: np.random.Generator) -> list[Box]:
    """The boxes, some of them where random ones would lie."""
    result = list(boxes)
    for k, other in zip(which, random_boxes(rng, len(which)), strict=True):
        result[k] = replace(other, size=boxes[k].size)
    return result


def _rows(rng: np.random.Generator) -> Heap:
    """Two rows of identical boxes on either side of the corridor, the outer ones two high.
    At one end they are one box higher: without that, both ends would be the same, turned round."""
    size, period = rng.uniform((0.3, 0.25, 0.2), (0.5, 0.4, 0.35)), rng.uniform(0.6, 1.2)
    last = int(2.4 / period)
    boxes = []
    for level, y in enumerate((CORRIDOR_M / 2 + 0.3, CORRIDOR_M / 2 + 1.1)):
        for k in range(-last, last + 1):
            for side in (-1.0, 1.0):
                box = Box(size, (k * period, side * y), 0.0, np.zeros(2))
                boxes += [box] * (1 + level + (k == last))
    return pile_up(boxes)

"""The kinds of negative cases, and the places beside which they are counted."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from tests.negatives import worlds
from tests.negatives.views import Flown, View

Make = Callable[[Sequence[Flown], np.random.Generator, int], list[View]]
"""So many views, from flights (the last over a flat floor) and a source of random numbers."""


def place(flown: Sequence[Flown], rng: np.random.Generator, maps: int) -> list[View]:
    """Aerial maps of a flight over the map of their own ground robot."""
    return _surfaces(_heap(flown, rng), rng, maps)


def other_heap(flown: Sequence[Flown], rng: np.random.Generator, maps: int) -> list[View]:
    """Over the map of another heap, the heading at random."""
    first, second = rng.choice(len(flown) - 1, 2, replace=False)
    angle = rng.uniform(-np.pi, np.pi)
    views = _surfaces(flown[first], rng, maps)
    return [view.over(flown[second].map).turned(angle) for view in views]


def mirrored(flown: Sequence[Flown], rng: np.random.Generator, maps: int) -> list[View]:
    """Over the mirror image of their own map, the heading at random."""
    angle = rng.uniform(-np.pi, np.pi)
    views = _surfaces(_heap(flown, rng), rng, maps)
    return [view.mirrored().turned(angle) for view in views]


def no_overlap(flown: Sequence[Flown], rng: np.random.Generator, maps: int) -> list[View]:
    """Over their own map, cut away along a line until a tenth of each surface lies over it."""
    angle = rng.uniform(-np.pi, np.pi)
    away = np.array([np.cos(angle), np.sin(angle)])
    views = _surfaces(_heap(flown, rng), rng, maps)
    return [
        view.cut(worlds.LEFT, lambda points: points[:, :2] @ away, views[:k])
        for k, view in enumerate(views)
    ]


def flat(flown: Sequence[Flown], rng: np.random.Generator, maps: int) -> list[View]:
    """Over a flat floor; or of one, over itself or over a heap."""
    floor, heap = flown[-1], _heap(flown, rng)
    over, under = ((heap, floor), (floor, heap), (floor, floor))[rng.integers(3)]
    angle = rng.uniform(-np.pi, np.pi)
    return [view.over(under.map).turned(angle) for view in _surfaces(over, rng, maps)]


def _heap(flown: Sequence[Flown], rng: np.random.Generator) -> Flown:
    return flown[int(rng.integers(len(flown) - 1))]


def _surfaces(flight: Flown, rng: np.random.Generator, maps: int) -> list[View]:
    """Consecutive aerial maps, from a random one on."""
    first = int(rng.integers(max(1, len(flight.views) - maps + 1)))
    return list(flight.views[first : first + maps])


def _without_flights(make: Callable[[np.random.Generator, int], list[View]]) -> Make:
    return lambda _, rng, maps: make(rng, maps)


NEGATIVES: dict[str, Make] = {
    "other heap": other_heap,
    "twin piles": _without_flights(worlds.twins),
    "rows, moved": _without_flights(worlds.rows_moved),
    "mirrored": mirrored,
    "no overlap": no_overlap,
    "flat": flat,
}
"""Kinds of cases without a place: every claim is wrong."""
PLACES: dict[str, Make] = {
    "heap": place,
    "pile": _without_flights(worlds.same),
    "pile, changed": _without_flights(worlds.changed),
    "rows": _without_flights(worlds.rows),
}
"""Kinds of cases with a place: a claim is wrong if it is elsewhere."""

"""Heaps of cardboard boxes: drawn, dropped, settled by physics, then frozen where they lie."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from airground.errors import InputError
from sim.geometry.box import Box
from sim.geometry.settling import Fall, Heap
from sim.scene import Rubble, Scene


def make_heap(scene: Scene, rng: np.random.Generator, fixed: Sequence[Box] = ()) -> tuple[Box, ...]:
    """Drop the boxes of `scene` and return them as they came to rest.

    Boxes fall while a wall keeps the ground robot's lane free; then the wall goes, and what
    falls into the lane or lies too high is thrown again. The same generator state gives the
    same heap. Boxes lie beside and on the `fixed` things.

    Raises:
        InputError: So few boxes fit beside the lane that less than nine tenths remain.
    """
    rubble = scene.rubble
    if rubble is None:
        return ()
    makes, sizes = _draw_boxes(rubble, rng)
    heap = Heap(scene, Fall.of(rubble, len(sizes)), sizes, rng, fixed)
    heap.drop(rng)
    kept = heap.remaining()
    if len(kept) < 0.9 * rubble.boxes:
        raise InputError(
            f"scene '{scene.name}': only {len(kept)} of rubble.boxes = {rubble.boxes} fit into "
            f"rubble.area_m = {list(rubble.area_m)} beside the ground robot's lane"
        )
    poses = heap.poses()
    return tuple(Box(f"box_{k:03d}", int(makes[i]), sizes[i], poses[i]) for k, i in enumerate(kept))


def _draw_boxes(rubble: Rubble, rng: np.random.Generator) -> tuple[NDArray, NDArray]:
    """Make (N,) and size (N, 3) [m] of every box."""
    low, high = rubble.edge_m
    # Small edges are more common than large ones, as in a real delivery.
    edges = low + (high - low) * rng.beta(1.3, 1.7, (rubble.makes, 3))
    edges.sort(axis=1)
    edges = edges[:, [2, 1, 0]]  # longest first: a box stands on its largest face
    makes = rng.integers(0, rubble.makes, rubble.boxes)
    makes[rng.random(rubble.boxes) < rubble.self_similarity] = 0
    return makes, np.round(rubble.size_scale * edges[makes], 3)

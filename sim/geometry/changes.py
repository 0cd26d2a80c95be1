"""A heap that changes: some boxes have moved, fallen or gone, the others stay as they lie."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from sim.geometry.box import Box
from sim.geometry.settling import ROUNDS, Fall, Heap
from sim.scene import Scene

ChangeKind = Literal["moved", "fallen", "gone"]
KINDS: tuple[ChangeKind, ...] = get_args(ChangeKind)
LEAST_SHIFT_M, LEAST_TURN_DEG = 0.05, 10.0
"""A box that has shifted less than this [m] and turned less than this [deg] is thrown again:
it would hardly be seen to have changed."""


@dataclass(frozen=True, eq=False)
class Change:
    """What happened to a box.

    Attributes:
        kind: Other place ("moved"), near its place but turned ("fallen"), or "gone".
        before: The box as it lay.
        after: The box as it lies then; None if it is gone.
    """

    kind: ChangeKind
    before: Box
    after: Box | None


def change_heap(scene: Scene, boxes: Sequence[Box], rng: np.random.Generator) -> tuple[Change, ...]:
    """Change the share `rubble.changed` of the boxes, in the order of `boxes`.

    Only boxes on which no box lies that stays are changed, so all others keep their poses. Moved
    and fallen boxes are dropped and settle by physics, off the ground robot's lane; one that finds
    no place in several throws is gone. A larger share changes the same boxes and more.
    """
    if scene.rubble is None:
        return ()
    order_rng, kind_rng, throw_rng = rng.spawn(3)
    count = round(scene.rubble.changed * len(boxes))
    if count == 0:
        return ()
    chosen = _from_the_top(scene, boxes, count, order_rng)
    kinds = [KINDS[k] for k in kind_rng.integers(len(KINDS), size=count)]
    before = [boxes[k] for k in chosen]
    fixed = [box for k, box in enumerate(boxes) if k not in set(chosen)]
    after = _resettled(scene, before, kinds, fixed, throw_rng)
    changes = [
        Change("gone" if new is None else kind, old, new)
        for kind, old, new in zip(kinds, before, after, strict=True)
    ]
    return tuple(changes[k] for k in np.argsort(chosen))


def boxes_after(boxes: Sequence[Box], changes: Sequence[Change]) -> tuple[Box, ...]:
    """All boxes that are there after the changes, in their order."""
    changed = {change.before.name: change.after for change in changes}
    present = (changed.get(box.name, box) for box in boxes)
    return tuple(box for box in present if box is not None)


def _from_the_top(
    scene: Scene, boxes: Sequence[Box], count: int, rng: np.random.Generator
) -> list[int]:
    """Indices of boxes, each free of boxes above it once those before it are taken away."""
    heap = _heap(scene, boxes, rng)
    heap.lay([box.T_world_box for box in boxes])
    heights = np.array([box.T_world_box.translation[2] for box in boxes])
    lies_on = heap.touching() & (heights[:, None] > heights)  # the row's box on the column's
    here = np.ones(len(boxes), bool)
    chosen = []
    for _ in range(count):
        free = np.flatnonzero(here & ~lies_on[here].any(0))
        chosen.append(int(rng.choice(free)))
        here[chosen[-1]] = False
    return chosen


def _resettled(
    scene: Scene,
    before: Sequence[Box],
    kinds: Sequence[ChangeKind],
    fixed: Sequence[Box],
    rng: np.random.Generator,
) -> list[Box | None]:
    """The boxes where they come to rest among fixed ones; None where they are gone."""
    heap = _heap(scene, before, rng, fixed)
    homes = {
        k: box.T_world_box.translation[:2] for k, box in enumerate(before) if kinds[k] == "fallen"
    }
    heap.park(np.array([k for k, kind in enumerate(kinds) if kind == "gone"], int))
    bad = heap.remaining()
    for _ in range(1 + ROUNDS):
        heap.throw(bad, rng, homes)
        heap.settle(walled=True)
        heap.settle(walled=False)
        bad = np.union1d(heap.offenders(), _alike(heap, before))
        if not len(bad):
            break
    while len(bad):
        heap.park(bad)
        heap.settle(walled=False)
        bad = np.union1d(heap.offenders(), _alike(heap, before))
    poses = heap.poses()
    return [
        None if heap.parked[k] else replace(box, T_world_box=poses[k])
        for k, box in enumerate(before)
    ]


def _heap(
    scene: Scene, boxes: Sequence[Box], rng: np.random.Generator, fixed: Sequence[Box] = ()
) -> Heap:
    """Boxes that fall among fixed ones."""
    assert scene.rubble is not None
    sizes = np.array([box.size_m for box in boxes])
    return Heap(scene, Fall.of(scene.rubble, len(boxes)), sizes, rng, fixed)


def _alike(heap: Heap, before: Sequence[Box]) -> NDArray[np.int64]:
    """Boxes that lie as they did before."""
    poses = heap.poses()
    alike = []
    for k in heap.remaining():
        motion = before[k].T_world_box.inverse() @ poses[k]
        shift = np.linalg.norm(poses[k].translation - before[k].T_world_box.translation)
        if shift < LEAST_SHIFT_M and np.rad2deg(motion.angle()) < LEAST_TURN_DEG:
            alike.append(k)
    return np.array(alike, np.int64)

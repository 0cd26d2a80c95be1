"""The debris of a building: slabs, beams and brickwork, settled around stumps of columns."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from airground.core.se3 import SE3
from airground.errors import InputError
from sim.geometry.box import Box
from sim.geometry.lane import distance_to_footprint, lane_points
from sim.geometry.parts import Kind
from sim.geometry.settling import Fall, Heap
from sim.scene import Debris, Scene

COLUMN_M = (0.22, 0.34)
"""Thickness of columns [m]."""
SLAB_THICKNESS_M = (0.1, 0.18)
"""Of floors and walls of concrete [m]."""
BEAM_THICKNESS_M = (0.12, 0.22)
"""Height and width of a beam's section [m]."""
LEAST_SHARE = 0.75
"""Of the pieces that fall, so many must find a place."""
_COLUMN_TRIES = 200
_TUMBLE = {"slab": 0.22, "beam": 0.35, "brick": 1.0}


def drop_debris(
    scene: Scene, rng: np.random.Generator, fixed: Sequence[Box] = ()
) -> tuple[Box, ...]:
    """Drop the debris of `scene` beside and on the `fixed` things, and return it at rest.

    Half the brickwork falls first, then beams, then slabs, which come to lean on all that; the
    other half falls on top. The same generator state gives the same heap.

    Raises:
        InputError: Less than three quarters of the pieces fit beside the ground robot's lane.
    """
    debris = scene.debris
    if debris is None:
        return ()
    columns = _columns(scene, debris, rng)
    kinds, sizes = _pieces(debris, rng)
    if not kinds:
        return columns
    tumble = np.array([_TUMBLE[kind] for kind in kinds])
    fall = Fall(debris.area_m, debris.piles, debris.clearance_m, debris.height_m, tumble)
    heap = Heap(scene, fall, sizes, rng, [*fixed, *columns])
    heap.drop(rng)
    kept, poses = heap.remaining(), heap.poses()
    if len(kept) < LEAST_SHARE * len(kinds):
        raise InputError(
            f"scene '{scene.name}': only {len(kept)} of {len(kinds)} pieces fit into "
            f"debris.area_m = {list(debris.area_m)} beside the ground robot's lane"
        )
    pieces = [Box(f"{kinds[k]}_{k:03d}", 0, sizes[k], poses[k], kinds[k]) for k in kept]
    return (*columns, *pieces)


def _pieces(debris: Debris, rng: np.random.Generator) -> tuple[list[Kind], NDArray[np.float64]]:
    """Kinds and sizes (N, 3) [m] of what falls, in the order in which it is hung up."""
    slabs = np.column_stack(
        [
            rng.uniform(*debris.slab_m, (debris.slabs, 2)),
            rng.uniform(*SLAB_THICKNESS_M, debris.slabs),
        ]
    )
    section = rng.uniform(*BEAM_THICKNESS_M, (debris.beams, 2))
    beams = np.column_stack([rng.uniform(*debris.beam_m, debris.beams), section])
    # Small lumps are more common than large ones.
    small, large = debris.brick_m
    longest = small * (large / small) ** (rng.random(debris.bricks) ** 1.5)
    bricks = longest[:, None] * rng.uniform([1, 0.5, 0.3], [1, 0.9, 0.6], (debris.bricks, 3))
    half = debris.bricks // 2
    order: list[tuple[Kind, NDArray]] = [
        ("brick", bricks[:half]),
        ("beam", beams),
        ("slab", slabs),
        ("brick", bricks[half:]),
    ]
    kinds = [kind for kind, sizes in order for _ in sizes]
    return kinds, np.round(np.concatenate([sizes for _, sizes in order]), 3)


def _columns(scene: Scene, debris: Debris, rng: np.random.Generator) -> tuple[Box, ...]:
    """Stumps that stand off the lane, as far from each other as many tries bring them."""
    lane, half = lane_points(scene), np.array(debris.area_m) / 2
    columns: list[Box] = []
    for number in range(debris.columns):
        width = rng.uniform(*COLUMN_M)
        tall = rng.uniform(0.35, 0.75) * debris.height_m
        places = rng.uniform(-half, half, (_COLUMN_TRIES, 2))
        taken = np.array([box.T_world_box.translation[:2] for box in columns]).reshape(-1, 2)
        apart = np.linalg.norm(places[:, None] - taken[None], axis=2).min(1, initial=1.5)
        for k in np.argsort(-apart, kind="stable"):
            centre = np.array([*places[k], tall / 2])
            size = np.array([width, width, tall])
            box = Box(f"column_{number:03d}", 0, size, SE3(np.eye(3), centre), "column")
            if distance_to_footprint(lane, box.corners()) >= debris.clearance_m:
                columns.append(box)
                break
    return tuple(columns)

"""What stands and lies on a floor, put into MuJoCo as cuboids with lit pictures."""

from __future__ import annotations

import mujoco
import numpy as np

from sim.appearance.bake_light import LightBaker
from sim.appearance.built_pictures import paint_built
from sim.appearance.cardboard import Make
from sim.appearance.pictures import add_picture, paint_boxes
from sim.appearance.print_marks import BRANDS
from sim.geometry.box import Box
from sim.geometry.debris import drop_debris
from sim.geometry.rubble import make_heap
from sim.geometry.shelves import stand_shelves
from sim.geometry.street import lay_street
from sim.scene import Scene

HEAPED = "box_"
"""Names of boxes of `[rubble]` begin so."""


def make_things(scene: Scene, rng: np.random.Generator) -> tuple[Box, ...]:
    """All cuboids of a scene: boxes of the heap, then racks, debris, and the street.

    Debris falls on and beside racks, boxes on and beside both.

    Raises:
        InputError: They do not fit.
    """
    shelves = stand_shelves(scene, rng)
    street = lay_street(scene, rng)
    built = (*shelves, *drop_debris(scene, rng, shelves))
    return (*make_heap(scene, rng, built), *built, *street)


def add_box_pictures(
    spec: mujoco.MjSpec,
    scene: Scene,
    before: tuple[Box, ...],
    boxes: tuple[Box, ...],
    baker: LightBaker,
    rng: np.random.Generator,
) -> None:
    """Give every one of `boxes` six pictures of its own, the same wherever it was `before`."""
    heap = tuple(box for box in before if box.name.startswith(HEAPED))
    lying = tuple(box for box in boxes if box.name.startswith(HEAPED))
    names = rng.permutation(BRANDS)
    if scene.rubble:
        makes = [Make.draw(rng, str(names[k % len(names)])) for k in range(scene.rubble.makes)]
        own = dict(zip((box.name for box in heap), rng.spawn(len(heap)), strict=True))
        rngs = [own[box.name] for box in lying]
        pictures = paint_boxes(lying, makes, scene.texture, scene.rubble.printed, baker, rngs)
        for box, picture in zip(lying, pictures, strict=True):
            add_picture(spec, box.name, picture, cube=True)
    built = tuple(box for box in boxes if not box.name.startswith(HEAPED))
    if built:
        make = Make.draw(rng, str(names[0]))
        for box, picture in zip(
            built, paint_built(built, make, scene.texture, baker, rng), strict=True
        ):
            add_picture(spec, box.name, picture, cube=True)


def add_boxes(spec: mujoco.MjSpec, boxes: tuple[Box, ...], pictures: bool) -> None:
    """Add every box as a geom of its name."""
    for box in boxes:
        spec.worldbody.add_geom(
            name=box.name,
            type=mujoco.mjtGeom.mjGEOM_BOX,
            size=box.size_m / 2,
            pos=box.T_world_box.translation,
            quat=np.roll(box.T_world_box.quaternion_xyzw(), 1),
            **({"material": box.name} if pictures else {"rgba": [0.72, 0.55, 0.36, 1]}),
        )

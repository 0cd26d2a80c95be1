"""Pictures on what people have built: alike on what repeats, each its own on debris."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

import numpy as np
from numpy.typing import NDArray

from sim.appearance.bake_light import LightBaker
from sim.appearance.cardboard import FaceKind, Make, paint_face
from sim.appearance.house_front import paint_front
from sim.appearance.masonry import (
    paint_brickwork,
    paint_chipboard,
    paint_concrete_face,
    paint_paving,
    paint_steel,
)
from sim.appearance.pictures import cube_faces, face_light, lit_cube
from sim.geometry.box import Box
from sim.geometry.noise import Image
from sim.geometry.parts import Kind

REPEATED: tuple[Kind, ...] = ("box", "post", "board", "pavement")
"""Things of these kinds and of one size have one picture; only light differs."""
PX_PER_M = 400.0
"""Finest picture of what is built: a camera at 1 m sees 420 to 525 pixels a metre."""
COARSE_PX_PER_M: dict[Kind, float] = {"board": 200, "post": 200, "pavement": 160, "front": 70}
"""The same of what is mostly hidden, or far from the cameras."""
_LEAST_PX, _MOST_PX = 96, 512
_Painter = Callable[[tuple[float, float], float, np.random.Generator], Image]
_PAINTERS: dict[Kind, _Painter] = {
    "post": paint_steel,
    "board": paint_chipboard,
    "column": paint_concrete_face,
    "slab": paint_concrete_face,
    "beam": paint_concrete_face,
    "brick": paint_brickwork,
    "pavement": paint_paving,
    "front": paint_front,
}


def paint_built(
    boxes: Sequence[Box], make: Make, texture: float, baker: LightBaker, rng: np.random.Generator
) -> list[NDArray[np.uint8]]:
    """The lit cube picture (6 side, side, 3) of every cuboid.

    Args:
        boxes: Cuboids where they are.
        make: Print of those of kind "box".
        texture: Contrast of the pictures, 1 as drawn.
        baker: Light on the pictures.
        rng: Source of the pictures.
    """
    light = face_light(boxes, baker)
    unlit: dict[tuple[object, ...], list[Image]] = {}
    pictures = []
    for index, (box, own) in enumerate(zip(boxes, rng.spawn(len(boxes)), strict=True)):
        side = _side(box)
        key = (box.kind, *box.size_m) if box.kind in REPEATED else (box.name,)
        faces = unlit.get(key)
        if faces is None:
            painter = partial(_painted, box, make, side, own)
            faces = cube_faces(box.size_m, texture, painter)
            if box.kind in REPEATED:
                unlit[key] = faces
        pictures.append(lit_cube(faces, light[index], side))
    return pictures


def _painted(
    box: Box,
    make: Make,
    side: int,
    rng: np.random.Generator,
    size_m: tuple[float, float],
    kind: FaceKind,
) -> Image:
    if box.kind == "box":
        return paint_face(make, size_m, kind, side, rng)
    return _PAINTERS[box.kind](size_m, side / float(box.size_m.max()), rng)


def _side(box: Box) -> int:
    """Pixels of a side of the cube picture: those of the longest edge, in steps of 32."""
    px_per_m = COARSE_PX_PER_M.get(box.kind, PX_PER_M)
    wanted = 32 * round(float(box.size_m.max()) * px_per_m / 32)
    return int(np.clip(wanted, _LEAST_PX, _MOST_PX))

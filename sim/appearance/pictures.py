"""Pictures on geometry: generated, lit, and handed to MuJoCo as textures."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor

import mujoco
import numpy as np
from numpy.typing import NDArray

from airground.core.se3 import SE3
from sim.appearance.bake_light import LightBaker
from sim.appearance.cardboard import FaceKind, Make, paint_face
from sim.appearance.sheet import faded, light_up
from sim.geometry.box import Box
from sim.geometry.noise import Image

# What a cube texture shows on each face of a box, in MuJoCo's order: outward normal, and the
# box axes along which columns and rows grow (OpenGL's convention; a rendered test pins it).
CUBE_FACES: tuple[tuple[tuple[int, int, int], ...], ...] = (
    ((1, 0, 0), (0, 0, -1), (0, -1, 0)),
    ((-1, 0, 0), (0, 0, 1), (0, -1, 0)),
    ((0, 1, 0), (1, 0, 0), (0, 0, 1)),
    ((0, -1, 0), (1, 0, 0), (0, 0, -1)),
    ((0, 0, 1), (1, 0, 0), (0, -1, 0)),
    ((0, 0, -1), (-1, 0, 0), (0, -1, 0)),
)
FACE_LIGHT_CELLS = 12


def add_picture(spec: mujoco.MjSpec, name: str, pixels: NDArray[np.uint8], cube: bool) -> None:
    """Add a texture and a material of the same name that glows: the light is already in it.

    `pixels` is (H, W, 3); for a cube, six squares stacked in the order of CUBE_FACES.
    """
    kind = mujoco.mjtTexture.mjTEXTURE_CUBE if cube else mujoco.mjtTexture.mjTEXTURE_2D
    height, width = pixels.shape[:2]
    texture = spec.add_texture(name=name, type=kind, width=width, height=height, nchannel=3)
    texture.data = pixels.tobytes()
    material = spec.add_material(
        name=name, emission=1, specular=0, shininess=0, reflectance=0, rgba=[1, 1, 1, 1]
    )
    textures = list(material.textures)
    textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = name
    material.textures = textures


def paint_boxes(
    boxes: tuple[Box, ...],
    makes: list[Make],
    texture: float,
    printed: float,
    baker: LightBaker,
    rngs: Sequence[np.random.Generator],
) -> list[NDArray[np.uint8]]:
    """The lit cube picture (6 side, side, 3) of every box.

    Args:
        boxes: Boxes where they lie.
        makes: What boxes of each make share.
        texture: Contrast of the pictures, 1 as drawn.
        printed: Share of boxes with print.
        baker: Light on the pictures.
        rngs: Source of the features of each box alone.
    """
    if not boxes:
        return []
    light = face_light(boxes, baker)
    with ThreadPoolExecutor(len(os.sched_getaffinity(0))) as pool:
        jobs = [
            pool.submit(_cube_picture, box, makes[box.make], texture, printed, light[i], own)
            for i, (box, own) in enumerate(zip(boxes, rngs, strict=True))
        ]
        return [job.result() for job in jobs]


def _cube_picture(
    box: Box,
    make: Make,
    texture: float,
    printed: float,
    light: NDArray[np.float32],
    rng: np.random.Generator,
) -> NDArray[np.uint8]:
    side = _resolution(box.size_m)
    # Drawn apart: the same box is printed or not whatever is painted on it.
    has_print = bool(rng.spawn(1)[0].random() < printed)

    def paint(size_m: tuple[float, float], kind: FaceKind) -> Image:
        return paint_face(make, size_m, kind, side, rng, has_print)

    return lit_cube(cube_faces(box.size_m, texture, paint), light, side)


def cube_faces(
    size_m: NDArray[np.float64],
    texture: float,
    paint: Callable[[tuple[float, float], FaceKind], Image],
) -> list[Image]:
    """Unlit pictures on the faces of a cuboid, turned as a cube texture has them.

    Args:
        size_m: (3,) edges [m].
        texture: Contrast of the pictures, 1 as drawn.
        paint: Painter of a face by its width and height [m] and its kind, upright.
    """
    faces = []
    for normal, columns, rows in CUBE_FACES:
        right, down = _upright(normal)
        width, height = (float(np.abs(axis) @ size_m) for axis in (right, down))
        kind: FaceKind = "flaps" if normal[2] else "end" if normal[0] else "side"
        pixels = faded(paint((width, height), kind), texture)
        turns = _quarter_turns(right, down, columns, rows)
        faces.append(np.ascontiguousarray(np.rot90(pixels, turns)))
    return faces


def lit_cube(faces: Sequence[Image], light: NDArray[np.float32], side: int) -> NDArray[np.uint8]:
    """(6 side, side, 3) cube picture of `faces` in the light (6, n, n, 3) on them."""
    cube = np.empty((6 * side, side, 3), np.uint8)
    for index, face in enumerate(faces):
        light_up(face, light[index], cube[index * side : (index + 1) * side])
    return cube


def _resolution(size_m: NDArray) -> int:
    """Pixels along the longest edge, about one a millimetre."""
    longest = float(size_m.max())
    return 256 if longest < 0.2 else 384 if longest < 0.32 else 512


def _upright(normal: tuple[int, ...]) -> tuple[NDArray, NDArray]:
    """Right and down of a face's picture on a standing box, seen from outside."""
    n = np.array(normal)
    if normal[2]:
        right = np.array([1, 0, 0])
        return right, -np.cross(n, right)
    return np.cross([0, 0, 1], n), np.array([0, 0, -1])


def _quarter_turns(right: NDArray, down: NDArray, columns: tuple, rows: tuple) -> int:
    """How often `np.rot90` must turn a picture until it grows along `columns` and `rows`."""
    for turns in range(4):
        if (right == columns).all() and (down == rows).all():
            return turns
        right, down = down, -right
    raise AssertionError("a face's picture is never mirrored")


def face_light(boxes: Sequence[Box], baker: LightBaker) -> NDArray[np.float32]:
    """(N, 6, n, n, 3) light factors on the faces of every box."""
    n = FACE_LIGHT_CELLS
    cells = (np.arange(n) + 0.5) / n * 2 - 1
    v, u = np.meshgrid(cells, cells, indexing="ij")
    frames = np.array(CUBE_FACES, float)
    on_cube = (
        frames[:, None, None, 0]
        + u[None, ..., None] * frames[:, None, None, 1]
        + v[None, ..., None] * frames[:, None, None, 2]
    ).reshape(-1, 3)
    normals = np.repeat(frames[:, 0], n * n, axis=0)
    points = [box.T_world_box @ (on_cube * box.size_m / 2) for box in boxes]
    turned = [SE3(box.T_world_box.rotation, np.zeros(3)) @ normals for box in boxes]
    light = baker.shade(np.concatenate(points), np.concatenate(turned))
    return light.reshape(len(boxes), 6, n, n, 3)

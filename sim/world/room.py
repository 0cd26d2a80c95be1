"""The floor and the walls of a room."""

from __future__ import annotations

import cv2
import mujoco
import numpy as np
from numpy.typing import NDArray

from sim.appearance.bake_light import LightBaker
from sim.appearance.floor import (
    paint_asphalt,
    paint_concrete,
    paint_plain,
    paint_plaster,
    paint_print,
)
from sim.appearance.pictures import add_picture
from sim.appearance.sheet import faded, light_up
from sim.geometry.noise import Image
from sim.geometry.parts import Part
from sim.geometry.surface import Mesh, join, rectangle_mesh
from sim.scene import Room

FLOOR_PX_PER_M = 480.0
MOST_FLOOR_PX = 24e6
"""Pixels of the picture of a larger floor, which is coarser; that of 10 x 10 m has 23 million."""
WALL_PX_PER_M = 300.0
FLOOR_LIGHT_CELL_M = 0.025
MOST_LIGHT_CELLS = 200_000
"""On the floor: a larger one has larger cells."""
WALL_LIGHT_CELL_M = 0.1  # no box stands close enough for its shadow to have an edge there
PAINTED_FLOORS = {
    "concrete": paint_concrete,
    "plain": paint_plain,
    "printed": paint_print,
    "asphalt": paint_asphalt,
}
COLLISION_GROUP = 3
"""Geoms of this group collide and are never drawn."""


def add_room(
    spec: mujoco.MjSpec,
    room: Room,
    texture: float,
    baker: LightBaker | None,
    rng: np.random.Generator,
) -> None:
    """Add the floor, the walls and the invisible plane on which things stand.

    Args:
        texture: Contrast of the pictures, 1 as drawn.
        baker: Lights the pictures; without it, surfaces get plain colours.
        rng: Source of the pictures.
    """
    add_ground_plane(spec)
    _add_floor(spec, room, texture, baker, rng)
    for index, (centre, normal, half_width) in enumerate(_walls(room)):
        name = f"wall_{index}"
        half_size = np.array([half_width, room.wall_height_m / 2])
        if baker:
            pixels = paint_plaster((2 * half_size[0], 2 * half_size[1]), WALL_PX_PER_M, rng)
            right = np.cross([0.0, 0.0, 1.0], normal)
            up = np.array([0, 0, half_size[1]])
            light = _light_map(baker, centre, right * half_size[0], up, WALL_LIGHT_CELL_M)
            add_picture(spec, name, _lit(faded(pixels, texture), light), cube=False)
        _add_panel(spec, name, half_size, centre, _wall_quaternion(normal), baker is not None)


def _add_floor(
    spec: mujoco.MjSpec,
    room: Room,
    texture: float,
    baker: LightBaker | None,
    rng: np.random.Generator,
) -> None:
    """One picture over the whole floor, so that nothing repeats and no seam shows."""
    half = np.array(room.size_m) / 2
    if baker:
        paint = PAINTED_FLOORS[room.floor]
        right, up = np.array([half[0], 0, 0]), np.array([0, half[1], 0])
        area_m2 = float(np.prod(room.size_m))
        cell_m = max(FLOOR_LIGHT_CELL_M, float(np.sqrt(area_m2 / MOST_LIGHT_CELLS)))
        light = _light_map(baker, np.zeros(3), right, up, cell_m)
        px_per_m = min(FLOOR_PX_PER_M, float(np.sqrt(MOST_FLOOR_PX / area_m2)))
        pixels = faded(paint(room.size_m, px_per_m, rng), texture)
        add_picture(spec, "floor", _lit(pixels, light), cube=False)
    _add_panel(spec, "floor", half, np.zeros(3), np.array([1.0, 0, 0, 0]), baker is not None)


def _add_panel(
    spec: mujoco.MjSpec,
    name: str,
    half_size: NDArray,
    centre: NDArray,
    quat: NDArray,
    picture: bool,
) -> None:
    """A rectangle that is seen but not touched."""
    spec.worldbody.add_geom(
        name=name,
        type=mujoco.mjtGeom.mjGEOM_PLANE,
        size=[*half_size, 0.1],
        pos=centre,
        quat=quat,
        contype=0,
        conaffinity=0,
        **({"material": name} if picture else {"rgba": [0.62, 0.61, 0.58, 1]}),
    )


def _light_map(
    baker: LightBaker, centre: NDArray, half_right: NDArray, half_up: NDArray, cell_m: float
) -> NDArray[np.float32]:
    """(rows, columns, 3) light factors over a rectangle, the first row at its top."""
    rows, columns = (
        int(np.ceil(2 * np.linalg.norm(half) / cell_m)) for half in (half_up, half_right)
    )
    v = 1 - (np.arange(rows) + 0.5) / rows * 2
    u = (np.arange(columns) + 0.5) / columns * 2 - 1
    points = centre + u[None, :, None] * half_right + v[:, None, None] * half_up
    normal = np.cross(half_right, half_up)
    normals = np.broadcast_to(normal / np.linalg.norm(normal), points.shape)
    light = baker.shade(points.reshape(-1, 3), normals.reshape(-1, 3))
    smooth = cv2.GaussianBlur(light.reshape(rows, columns, 3), (3, 3), 0)
    return np.asarray(smooth, np.float32)


def _lit(pixels: Image, light: NDArray[np.float32]) -> NDArray[np.uint8]:
    out = np.empty(pixels.shape, np.uint8)
    light_up(pixels, light, out)
    return out


def add_ground_plane(spec: mujoco.MjSpec) -> None:
    """Add the invisible plane at z = 0 on which things stand."""
    spec.worldbody.add_geom(
        name="ground_plane",
        type=mujoco.mjtGeom.mjGEOM_PLANE,
        size=[0, 0, 1],
        group=COLLISION_GROUP,
        rgba=[0, 0, 0, 0],
    )


def room_mesh(room: Room) -> Mesh:
    """Two triangles for the floor and for each wall."""
    half_x, half_y = (side / 2 for side in room.size_m)
    meshes = [
        rectangle_mesh(
            np.array([-half_x, -half_y, 0]),
            np.array([2 * half_x, 0, 0]),
            np.array([0, 2 * half_y, 0]),
        )
    ]
    for centre, normal, half_width in _walls(room):
        right = np.cross([0.0, 0.0, 1.0], normal)
        corner = centre - right * half_width - np.array([0, 0, room.wall_height_m / 2])
        meshes.append(
            rectangle_mesh(corner, 2 * half_width * right, np.array([0, 0, room.wall_height_m]))
        )
    return join(meshes)


def room_parts(room: Room) -> list[Part]:
    """Floor and walls, in the order of the mesh."""
    walls = [Part(f"wall_{k}", "wall", 2) for k in range(len(_walls(room)))]
    return [Part("floor", "ground", 2), *walls]


def _walls(room: Room) -> list[tuple[NDArray, NDArray, float]]:
    """Centre, normal into the room and half width of each wall."""
    if room.wall_height_m == 0:
        return []
    half_x, half_y = (side / 2 for side in room.size_m)
    z = room.wall_height_m / 2
    return [
        (np.array([half_x, 0, z]), np.array([-1.0, 0, 0]), half_y),
        (np.array([-half_x, 0, z]), np.array([1.0, 0, 0]), half_y),
        (np.array([0, half_y, z]), np.array([0, -1.0, 0]), half_x),
        (np.array([0, -half_y, z]), np.array([0, 1.0, 0]), half_x),
    ]


def _wall_quaternion(normal: NDArray) -> NDArray[np.float64]:
    """(w, x, y, z) that turns a plane's x to the right, y up and z along `normal`."""
    right = np.cross([0.0, 0.0, 1.0], normal)
    quaternion = np.zeros(4)
    mujoco.mju_mat2Quat(quaternion, np.stack([right, [0, 0, 1.0], normal], axis=1).ravel())
    return quaternion

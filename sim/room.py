"""The floor and the walls of a room."""

from __future__ import annotations

import mujoco
import numpy as np
from numpy.typing import NDArray

from sim.scene import Room
from sim.surface import Mesh, join, rectangle_mesh

COLLISION_GROUP = 3
"""Geoms of this group collide and are never drawn."""


def add_plain_room(spec: mujoco.MjSpec, room: Room) -> None:
    """Add floor and walls in plain colours."""
    half_x, half_y = (side / 2 for side in room.size_m)
    add_ground_plane(spec)
    spec.worldbody.add_geom(
        name="floor",
        type=mujoco.mjtGeom.mjGEOM_PLANE,
        size=[half_x, half_y, 0.1],
        contype=0,
        conaffinity=0,
        rgba=[0.55, 0.55, 0.54, 1],
    )
    for index, (centre, normal, half_width) in enumerate(_walls(room)):
        spec.worldbody.add_geom(
            name=f"wall_{index}",
            type=mujoco.mjtGeom.mjGEOM_PLANE,
            size=[half_width, room.wall_height_m / 2, 0.1],
            pos=centre,
            quat=_wall_quaternion(normal),
            contype=0,
            conaffinity=0,
            rgba=[0.8, 0.8, 0.77, 1],
        )


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
            np.array([-half_x, -half_y, 0]), np.array([2 * half_x, 0, 0]), [0, 2 * half_y, 0]
        )
    ]
    for centre, normal, half_width in _walls(room):
        right = np.cross([0.0, 0.0, 1.0], normal)
        corner = centre - right * half_width - np.array([0, 0, room.wall_height_m / 2])
        meshes.append(
            rectangle_mesh(corner, 2 * half_width * right, np.array([0, 0, room.wall_height_m]))
        )
    return join(meshes)


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

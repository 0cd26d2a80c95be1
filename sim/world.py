"""A scene file and a seed become a world: geometry for physics, pictures and truth."""

from __future__ import annotations

import zlib
from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import ArrayLike, NDArray

from airground.core.arrays import read_only
from sim.room import add_plain_room, room_mesh
from sim.rubble import Box, make_heap
from sim.scene import Scene
from sim.surface import box_mesh, join

OFFSCREEN_PX = (1280, 960)


@dataclass(frozen=True, eq=False)
class World:
    """Everything that stands still, with no joints.

    Attributes:
        scene, seed: What it was built from.
        spec: MuJoCo specification to add robots and cameras to, then compile. Frame `world`.
        vertices: (V, 3) float64, the true surface in `world` [m].
        triangles: (T, 3) int64 vertex indices, counter-clockwise seen from outside.
        boxes: The settled boxes, if any.
    """

    scene: Scene
    seed: int
    spec: mujoco.MjSpec
    vertices: NDArray[np.float64]
    triangles: NDArray[np.int64]
    boxes: tuple[Box, ...]

    def __post_init__(self) -> None:
        vertices = read_only(self.vertices, "vertices", (None, 3), np.float64)
        triangles = read_only(self.triangles, "triangles", (None, 3), np.int64)
        object.__setattr__(self, "vertices", vertices)
        object.__setattr__(self, "triangles", triangles)

    def floor_height(self, x: ArrayLike, y: ArrayLike) -> NDArray[np.float64]:
        """Height of the bare ground below boxes and rocks [m]; NaN outside it."""
        x, y = np.broadcast_arrays(np.asarray(x, float), np.asarray(y, float))
        half = np.array(self.scene.room.size_m) / 2
        return np.where((np.abs(x) <= half[0]) & (np.abs(y) <= half[1]), 0.0, np.nan)


def build_world(scene: Scene, seed: int, pictures: bool = True) -> World:
    """Build the world of `scene`; the same seed gives the same bytes.

    Args:
        scene: What to build.
        seed: Decides shapes, poses and pictures; paths do not depend on it.
        pictures: Without them surfaces have plain colours: the same geometry much sooner,
            for physics and truth.
    """
    geometry_rng, _picture_rng = np.random.default_rng(
        [seed, zlib.crc32(scene.name.encode())]
    ).spawn(2)
    boxes = make_heap(scene, geometry_rng)
    spec = _empty_spec()
    add_plain_room(spec, scene.room)
    for box in boxes:
        _add_box(spec, box)
    meshes = [room_mesh(scene.room), *(box_mesh(box.size_m, box.T_world_box) for box in boxes)]
    return World(scene, seed, spec, *join(meshes), boxes)


def _empty_spec() -> mujoco.MjSpec:
    spec = mujoco.MjSpec()
    spec.visual.global_.offwidth, spec.visual.global_.offheight = OFFSCREEN_PX
    spec.visual.map.znear = 0.005
    spec.visual.map.zfar = 20
    spec.stat.extent = 5.0
    spec.stat.center = [0, 0, 0.5]
    return spec


def _add_box(spec: mujoco.MjSpec, box: Box) -> None:
    quaternion = box.T_world_box.quaternion_xyzw()
    spec.worldbody.add_geom(
        name=box.name,
        type=mujoco.mjtGeom.mjGEOM_BOX,
        size=box.size_m / 2,
        pos=box.T_world_box.translation,
        quat=np.roll(quaternion, 1),
        rgba=[0.72, 0.55, 0.36, 1],
    )

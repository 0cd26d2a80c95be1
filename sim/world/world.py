"""A scene file and a seed become a world: geometry for physics, pictures and truth."""

from __future__ import annotations

import zlib
from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import ArrayLike, NDArray

from airground.core.arrays import read_only
from sim.appearance.bake_light import LightBaker
from sim.geometry.box import Box
from sim.geometry.changes import Change, boxes_after, change_heap
from sim.geometry.ground_cover import grow_cover
from sim.geometry.parts import Part
from sim.geometry.rocks import scatter_rocks
from sim.geometry.surface import BOX_TRIANGLES, Mesh, box_mesh, join
from sim.geometry.terrain import HeightField, make_terrain
from sim.scene import Light, Scene, Terrain
from sim.world.indoor import add_box_pictures, add_boxes, make_things
from sim.world.outdoor import add_cover, add_ground, add_rocks
from sim.world.room import add_room, room_mesh, room_parts

# Mean linear reflectance of what bounces light.
_CONCRETE = (0.32, 0.31, 0.29)
_CARDBOARD = (0.42, 0.28, 0.15)
_SOIL = (0.26, 0.19, 0.12)
_STONE = (0.28, 0.26, 0.24)


@dataclass(frozen=True, eq=False)
class World:
    """Everything that stands still, with no joints.

    Attributes:
        scene, seed: Scene and seed of the world.
        spec: MuJoCo specification to add robots and cameras to, then compile. Frame `world`.
        vertices: (V, 3) float64, the true surface in `world` [m].
        triangles: (T, 3) int64 vertex indices, counter-clockwise seen from outside.
        parts: What the triangles belong to, in their order.
        boxes: Cuboids on a floor, if any: settled boxes, and what is built.
        terrain: The height field of natural ground; None is a floor at z = 0.
        changes: What has happened to boxes since the ground robot saw them, if anything.
    """

    scene: Scene
    seed: int
    spec: mujoco.MjSpec
    vertices: NDArray[np.float64]
    triangles: NDArray[np.int64]
    parts: tuple[Part, ...]
    boxes: tuple[Box, ...]
    terrain: HeightField | None = None
    changes: tuple[Change, ...] = ()

    def __post_init__(self) -> None:
        vertices = read_only(self.vertices, "vertices", (None, 3), np.float64)
        triangles = read_only(self.triangles, "triangles", (None, 3), np.int64)
        object.__setattr__(self, "vertices", vertices)
        object.__setattr__(self, "triangles", triangles)
        counted = sum(part.triangles for part in self.parts)
        if counted != len(triangles):
            raise ValueError(f"parts have {counted} triangles, the surface has {len(triangles)}")

    def floor_height(self, x: ArrayLike, y: ArrayLike) -> NDArray[np.float64]:
        """Height of the bare ground below boxes and rocks [m]; NaN outside it."""
        if self.terrain is not None:
            return self.terrain.at(x, y)
        x, y = np.broadcast_arrays(np.asarray(x, float), np.asarray(y, float))
        half = np.array(self.scene.room.size_m) / 2
        return np.where((np.abs(x) <= half[0]) & (np.abs(y) <= half[1]), 0.0, np.nan)


def build_world(scene: Scene, seed: int, pictures: bool = True) -> World:
    """Build the world of `scene`, as the ground robot sees it; the same seed gives the same bytes.

    Args:
        scene: Scene to build.
        seed: Decides shapes, poses and pictures; paths do not depend on it.
        pictures: Without them surfaces have plain colours: the same geometry much sooner,
            for physics and truth.
    """
    geometry_rng, picture_rng, _ = _streams(scene, seed)
    if scene.terrain:
        rngs = geometry_rng, picture_rng
        return _build_outdoor(scene, seed, scene.terrain, scene.light, *rngs, pictures)
    boxes = make_things(scene, geometry_rng)
    return _build_indoor(scene, seed, boxes, (), scene.light, picture_rng, pictures)


def painted(plain: World) -> World:
    """The same world as `build_world` makes it with pictures, from the one without; boxes do not
    settle again."""
    scene, seed = plain.scene, plain.seed
    geometry_rng, picture_rng, _ = _streams(scene, seed)
    if scene.terrain:
        rngs = geometry_rng, picture_rng
        return _build_outdoor(scene, seed, scene.terrain, scene.light, *rngs, True)
    return _build_indoor(scene, seed, plain.boxes, (), scene.light, picture_rng, True)


def flight_world(drive: World, pictures: bool = True) -> World:
    """The world as the MAV sees it: `drive`, that of the ground robot, if nothing changes.

    Args:
        drive: World from `build_world`, with or without pictures.
        pictures: As for `build_world`.
    """
    scene, seed = drive.scene, drive.seed
    geometry_rng, picture_rng, change_rng = _streams(scene, seed)
    changes = change_heap(scene, drive.boxes, change_rng)
    light = scene.light if scene.flight_light is None else scene.flight_light
    if not changes and light == scene.light:
        return drive
    rngs = geometry_rng, picture_rng
    if scene.terrain:
        return _build_outdoor(scene, seed, scene.terrain, light, *rngs, pictures)
    return _build_indoor(scene, seed, drive.boxes, changes, light, picture_rng, pictures)


def unlit_world(drive: World) -> World:
    """The world as the ground robot sees it, its pictures without light."""
    scene, seed = drive.scene, drive.seed
    geometry_rng, picture_rng, _ = _streams(scene, seed)
    if scene.terrain:
        rngs = geometry_rng, picture_rng
        return _build_outdoor(scene, seed, scene.terrain, None, *rngs, True)
    return _build_indoor(scene, seed, drive.boxes, (), None, picture_rng, True)


def _streams(scene: Scene, seed: int) -> list[np.random.Generator]:
    """Sources of geometry, of pictures, and of changes."""
    return np.random.default_rng([seed, zlib.crc32(scene.name.encode())]).spawn(3)


def _build_indoor(
    scene: Scene,
    seed: int,
    heap: tuple[Box, ...],
    changes: tuple[Change, ...],
    light: Light | None,
    picture_rng: np.random.Generator,
    pictures: bool,
) -> World:
    boxes = boxes_after(heap, changes)
    box_meshes = [box_mesh(box.size_m, box.T_world_box) for box in boxes]
    surface = join([room_mesh(scene.room), *box_meshes])
    spec = _empty_spec(pictures)
    # Walls throw no shadows, for the lamps hang inside the room.
    floor = room_mesh(scene.room.model_copy(update={"wall_height_m": 0.0}))
    baker = _baker(light, floor, box_meshes, _CONCRETE, _CARDBOARD) if pictures else None
    add_room(spec, scene.room, scene.texture, baker, picture_rng)
    if baker:
        add_box_pictures(spec, scene, heap, boxes, baker, picture_rng)
    add_boxes(spec, boxes, pictures)
    box_parts = [Part(box.name, box.kind, len(BOX_TRIANGLES)) for box in boxes]
    parts = (*room_parts(scene.room), *box_parts)
    return World(scene, seed, spec, *surface, parts, boxes, changes=changes)


def _build_outdoor(
    scene: Scene,
    seed: int,
    terrain: Terrain,
    light: Light | None,
    geometry_rng: np.random.Generator,
    picture_rng: np.random.Generator,
    pictures: bool,
) -> World:
    ground = make_terrain(scene.room.size_m, terrain.relief_m, terrain.clods_m, geometry_rng)
    rocks = scatter_rocks(scene, ground, geometry_rng)
    rock_meshes = [rock.mesh() for rock in rocks]
    cover = grow_cover(terrain, ground, rock_meshes, geometry_rng)
    things = [*rock_meshes, cover.mesh()]
    spec = _empty_spec(pictures)
    baker = _baker(light, ground.mesh(), things, _SOIL, _STONE) if pictures else None
    add_ground(spec, ground, scene, baker, picture_rng)
    add_rocks(spec, rocks, scene.texture, baker, picture_rng)
    add_cover(spec, cover, scene.texture, baker, picture_rng)
    surface = join([ground.mesh(), *things])
    parts = (
        Part("ground", "ground", len(ground.mesh()[1])),
        *(Part(rock.name, "rock", len(rock.mesh()[1])) for rock in rocks),
        *cover.parts(),
    )
    return World(scene, seed, spec, *surface, parts, (), ground)


def _baker(
    light: Light | None, floor: Mesh, things: list[Mesh], floor_albedo: tuple, thing_albedo: tuple
) -> LightBaker:
    mesh = join([floor, *things])
    albedo = np.tile(thing_albedo, (len(mesh[1]), 1))
    albedo[: len(floor[1])] = floor_albedo
    return LightBaker.of(mesh, albedo, light)


def _empty_spec(lit: bool) -> mujoco.MjSpec:
    spec = mujoco.MjSpec()
    spec.visual.headlight.active = int(not lit)
    spec.add_texture(
        name="sky",
        type=mujoco.mjtTexture.mjTEXTURE_SKYBOX,
        builtin=mujoco.mjtBuiltin.mjBUILTIN_GRADIENT,
        rgb1=[0.62, 0.72, 0.84],
        rgb2=[0.80, 0.82, 0.82],
        width=64,
        height=384,
    )
    spec.visual.map.znear = 0.005
    spec.visual.map.zfar = 20
    spec.stat.extent = 5.0
    spec.stat.center = [0, 0, 0.5]
    return spec

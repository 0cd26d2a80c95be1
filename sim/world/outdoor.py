"""Natural ground and rocks put into MuJoCo as meshes with lit pictures."""

from __future__ import annotations

import cv2
import mujoco
import numpy as np
from numpy.typing import NDArray

from sim.appearance.bake_light import LightBaker
from sim.appearance.cover_picture import PATCH_PX, lit_patches
from sim.appearance.ground_picture import paint_ground, paint_rock
from sim.appearance.pictures import add_picture
from sim.appearance.sheet import faded, light_up
from sim.geometry.ground_cover import GroundCover
from sim.geometry.noise import Image
from sim.geometry.rocks import Rock
from sim.geometry.surface import Mesh
from sim.geometry.terrain import HeightField
from sim.scene import Scene

GROUND_PX_PER_M = 420.0
ROCK_PX_PER_M = 450.0
LIGHT_CELL_M = 0.025
COVER_LIGHT_CELL_M = 0.0125
"""Light of the ground where small stones and plants throw shadows [m]: about half a stone."""
_PLAIN_GROUND = (0.55, 0.48, 0.38, 1)
_PLAIN_ROCK = (0.55, 0.54, 0.52, 1)


def add_ground(
    spec: mujoco.MjSpec,
    ground: HeightField,
    scene: Scene,
    baker: LightBaker | None,
    rng: np.random.Generator,
) -> None:
    """Add the terrain with one picture over all of it, so that no seam shows."""
    if baker:
        size = (float(ground.size_m[0]), float(ground.size_m[1]))
        painted = paint_ground(size, GROUND_PX_PER_M, (baker.light or scene.light).azimuth_deg, rng)
        unlit = faded(painted, scene.texture)
        picture = np.empty(unlit.shape, np.uint8)
        terrain = scene.terrain
        covered = terrain is not None and terrain.covered
        cell_m = COVER_LIGHT_CELL_M if covered else LIGHT_CELL_M
        light_up(unlit, _ground_light(ground, baker, cell_m), picture)
        add_picture(spec, "ground", picture, cube=False)
    coordinates = ground.picture_coordinates()
    _add_mesh(spec, "ground", ground.mesh(), coordinates, _PLAIN_GROUND, baker is not None)


def add_rocks(
    spec: mujoco.MjSpec,
    rocks: tuple[Rock, ...],
    texture: float,
    baker: LightBaker | None,
    rng: np.random.Generator,
) -> None:
    """Add every rock with a picture of its own."""
    for rock, own in zip(rocks, rng.spawn(len(rocks)), strict=True):
        side = int(np.clip(rock.diameter_m * ROCK_PX_PER_M * 0.8, 48, 320))
        if baker:
            picture = _rock_picture(rock, side, texture, baker, own)
            add_picture(spec, rock.name, picture, cube=False)
        coordinates = _rock_coordinates(rock.vertices.shape[1], side)
        _add_mesh(spec, rock.name, rock.mesh(), coordinates, _PLAIN_ROCK, baker is not None)


def add_cover(
    spec: mujoco.MjSpec,
    cover: GroundCover,
    texture: float,
    baker: LightBaker | None,
    rng: np.random.Generator,
) -> None:
    """Add small stones and plants as one mesh with one picture, a tile for each patch."""
    shapes = [patches.shape[:3] for patches in cover.patches()]
    count = sum(shape[0] for shape in shapes)
    if count == 0:
        return
    columns = int(np.ceil(np.sqrt(count)))
    if baker:
        tiles = np.zeros((columns * columns, PATCH_PX, PATCH_PX, 3), np.uint8)
        tiles[:count] = lit_patches(cover, texture, baker, rng)
        rows = tiles.reshape(columns, columns, PATCH_PX, PATCH_PX, 3).swapaxes(1, 2)
        side = columns * PATCH_PX
        add_picture(spec, "cover", rows.reshape(side, side, 3), cube=False)
    coordinates = _cover_coordinates(shapes, columns)
    _add_mesh(spec, "cover", cover.mesh(), coordinates, _PLAIN_ROCK, baker is not None)


def _cover_coordinates(shapes: list[tuple[int, ...]], columns: int) -> NDArray[np.float64]:
    """(V, 2) texture coordinates of groups of patches, (count, nodes down, nodes right) each.
    Nodes on a rim lie half a pixel inside their tile."""
    coordinates, first = [], 0
    for count, *nodes in shapes:
        inside = [(0.5 + np.linspace(0, PATCH_PX - 1, n)) / PATCH_PX for n in nodes]
        v, u = np.meshgrid(*inside, indexing="ij")
        tiles = np.divmod(np.arange(first, first + count), columns)
        row, column = (index[:, None, None] for index in tiles)
        coordinates.append(np.stack([column + u, row + v], axis=-1).reshape(-1, 2) / columns)
        first += count
    return np.concatenate(coordinates)


def _add_mesh(
    spec: mujoco.MjSpec,
    name: str,
    mesh: Mesh,
    coordinates: NDArray,
    plain: tuple[float, ...],
    picture: bool,
) -> None:
    """A mesh that is seen but not touched."""
    vertices, triangles = mesh
    spec.add_mesh(
        name=name,
        uservert=vertices.ravel(),
        userface=triangles.ravel().astype(np.int32),
        usertexcoord=coordinates.ravel(),
        inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL,
    )
    spec.worldbody.add_geom(
        name=name,
        type=mujoco.mjtGeom.mjGEOM_MESH,
        meshname=name,
        contype=0,
        conaffinity=0,
        **({"material": name} if picture else {"rgba": plain}),
    )


def _ground_light(ground: HeightField, baker: LightBaker, cell_m: float) -> Image:
    """(rows, columns, 3) light factors over the whole field, the first row at the largest y."""
    columns, rows = (int(np.ceil(side / cell_m)) for side in ground.size_m)
    x = ((np.arange(columns) + 0.5) / columns - 0.5) * ground.size_m[0]
    y = (0.5 - (np.arange(rows) + 0.5) / rows) * ground.size_m[1]
    x, y = (grid.ravel() for grid in np.meshgrid(x, y))
    points = np.stack([x, y, ground.at(x, y)], axis=1)
    light = baker.shade(points, ground.normals(x, y)).reshape(rows, columns, 3)
    return np.asarray(cv2.GaussianBlur(light, (3, 3), 0), np.float32)


def _rock_picture(
    rock: Rock, side: int, texture: float, baker: LightBaker, rng: np.random.Generator
) -> NDArray[np.uint8]:
    """(2 side, 3 side, 3): six lit patches."""
    light = baker.shade(rock.vertices.reshape(-1, 3), rock.normals().reshape(-1, 3))
    patches = np.concatenate([rock.vertices, light.reshape(rock.vertices.shape)], axis=-1)
    steps = np.linspace(0, rock.vertices.shape[1] - 1, side, dtype=np.float32)
    map_x, map_y = np.meshgrid(steps, steps)
    fine = np.empty((6, side, side, 6), np.float32)
    for k, patch in enumerate(patches.astype(np.float32)):
        for part in (slice(0, 3), slice(3, 6)):
            source = np.ascontiguousarray(patch[..., part])
            fine[k, ..., part] = cv2.remap(source, map_x, map_y, cv2.INTER_LINEAR)
    centre = rock.vertices.reshape(-1, 3).mean(0)
    pixels = faded(paint_rock(fine[..., :3] - centre, rock.diameter_m, rng), texture)
    lit = np.clip(pixels * fine[..., 3:] + 0.5, 0, 255).astype(np.uint8)
    return lit.reshape(2, 3, side, side, 3).swapaxes(1, 2).reshape(2 * side, 3 * side, 3)


def _rock_coordinates(n: int, side: int) -> NDArray[np.float64]:
    """(6 n n, 2) texture coordinates; nodes on a rim lie half a pixel inside their patch."""
    inside = (0.5 + np.arange(n) / (n - 1) * (side - 1)) / side
    v, u = np.meshgrid(inside, inside, indexing="ij")
    patches = [
        np.stack([(k % 3 + u) / 3, (k // 3 + v) / 2], axis=-1).reshape(-1, 2) for k in range(6)
    ]
    return np.concatenate(patches)

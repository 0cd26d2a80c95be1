"""Rocks: weathered polyhedra, each its own, half sunk into the ground."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import map_coordinates
from scipy.spatial.transform import Rotation

from airground.core.arrays import read_only
from sim.geometry.lane import lane_points
from sim.geometry.surface import Mesh
from sim.geometry.terrain import HeightField
from sim.scene import Scene

# Right, down and outward axis of the six patches of a rock; each is a grid of the cube's face
# pushed out onto the rock. They lie in the texture as three columns and two rows.
PATCHES = np.array(
    [
        [[0, 1, 0], [0, 0, -1], [1, 0, 0]],
        [[0, -1, 0], [0, 0, -1], [-1, 0, 0]],
        [[-1, 0, 0], [0, 0, -1], [0, 1, 0]],
        [[1, 0, 0], [0, 0, -1], [0, -1, 0]],
        [[1, 0, 0], [0, -1, 0], [0, 0, 1]],
        [[1, 0, 0], [0, 1, 0], [0, 0, -1]],
    ],
    float,
)
_PLANES = 12
_CORNERS = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) / np.sqrt(3)
_CLOSING = np.concatenate([_CORNERS, np.eye(3), -np.eye(3)])
ROUGHNESS_CELL_M = 0.04
"""Size of steps and hollows of a rough rock: two cells of a mesh of the largest rocks [m]."""
_ROUNDNESS = 14  # exponent of the smooth minimum over planes: the higher, the sharper


@dataclass(frozen=True, eq=False)
class Rock:
    """One rock with a unique name, `rock_000` and so on, and its mean width [m].

    `vertices` (6, n, n, 3) are the patches' nodes in `world` [m]; patches share their rims.
    """

    name: str
    diameter_m: float
    vertices: NDArray[np.float64]

    def __post_init__(self) -> None:
        fixed = read_only(self.vertices, "vertices", (6, None, None, 3), np.float64)
        object.__setattr__(self, "vertices", fixed)

    def mesh(self) -> Mesh:
        """Patches joined; nodes on their rims are doubled, for each has its own picture."""
        n = self.vertices.shape[1]
        corner = (np.arange(n - 1)[:, None] * n + np.arange(n - 1)[None]).ravel()
        # Rows go down, columns right: seen from outside this winds counter-clockwise.
        first = np.stack([corner, corner + n, corner + n + 1], axis=1)
        second = np.stack([corner, corner + n + 1, corner + 1], axis=1)
        one = np.concatenate([first, second])
        triangles = np.concatenate([one + patch * n * n for patch in range(6)])
        return self.vertices.reshape(-1, 3), triangles

    def normals(self) -> NDArray[np.float64]:
        """(6, n, n, 3) unit normals, outward."""
        down, right = np.gradient(self.vertices, axis=(1, 2))
        normals = np.cross(down, right)
        return normals / np.linalg.norm(normals, axis=-1, keepdims=True)


def scatter_rocks(scene: Scene, ground: HeightField, rng: np.random.Generator) -> tuple[Rock, ...]:
    """Place the rocks of `scene`, off the ground robot's lane."""
    terrain = scene.terrain
    if terrain is None:
        return ()
    lane = lane_points(scene, 0.1)
    half = np.array(terrain.area_m) / 2
    small, large = terrain.rock_m
    # Many small, few large: a power law, as broken rock has.
    diameters = small * (large / small) ** (rng.random(terrain.rocks) ** 1.5)
    rocks: list[Rock] = []
    places: list[NDArray] = []
    for diameter in np.sort(diameters)[::-1]:
        vertices = _shape(diameter, rng, terrain.rock_roughness_m)
        reach = float(np.linalg.norm(vertices[..., :2], axis=-1).max())
        for place in rng.uniform(-half, half, (60, 2)):
            off_lane = np.linalg.norm(lane - place, axis=1).min() - reach
            apart = [np.linalg.norm(place - p[:2]) - 0.4 * (diameter + p[2]) for p in places]
            if off_lane > terrain.clearance_m and min(apart, default=1.0) > 0:
                sunk = ground.at(*place) + 0.22 * np.ptp(vertices[..., 2])
                moved = vertices + np.array([*place, sunk])
                rocks.append(Rock(f"rock_{len(rocks):03d}", float(diameter), moved))
                places.append(np.array([*place, diameter]))
                break
    return tuple(rocks)


def cube_directions(n: int) -> NDArray[np.float64]:
    """(6, n, n, 3) points of the unit cube's faces; tangent-spaced, rims included."""
    t = np.tan(np.linspace(-np.pi / 4, np.pi / 4, n))
    right, down, out = (PATCHES[:, axis, None, None, :] for axis in range(3))
    return out + t[None, None, :, None] * right + t[None, :, None, None] * down


def _shape(diameter: float, rng: np.random.Generator, roughness_m: float) -> NDArray[np.float64]:
    """(6, n, n, 3) nodes around the origin [m]."""
    n = 10 if diameter < 0.25 else 14 if diameter < 0.5 else 20
    directions = cube_directions(n)
    directions /= np.linalg.norm(directions, axis=-1, keepdims=True)
    planes = rng.standard_normal((_PLANES, 3))
    planes /= np.linalg.norm(planes, axis=1, keepdims=True)
    distances = rng.uniform(0.72, 1.0, _PLANES)
    # Where chance leaves a gap between planes, the cube's corners and faces close it.
    planes = np.concatenate([planes, _CLOSING])
    distances = np.concatenate([distances, np.full(len(_CLOSING), 1.02)])
    facing = np.maximum(directions @ planes.T / distances, 0.05)
    radius = (facing**_ROUNDNESS).sum(-1) ** (-1 / _ROUNDNESS)
    lattice = rng.standard_normal((9, 9, 9))
    bumps = map_coordinates(lattice, (directions.reshape(-1, 3) * 3 + 4).T, order=3)
    radius *= 1 + 0.035 * bumps.reshape(radius.shape)
    stretch = rng.uniform([0.8, 0.65, 0.5], [1.15, 0.95, 0.8])
    turn = Rotation.from_euler("zyx", [rng.uniform(0, 2 * np.pi), *rng.normal(0, 0.25, 2)])
    nodes = directions * radius[..., None] * stretch * diameter / 2
    if roughness_m > 0:
        nodes += directions * _roughness(nodes, roughness_m, rng)[..., None]
    return turn.apply(nodes.reshape(-1, 3)).reshape(nodes.shape)


def _roughness(nodes: NDArray, height_m: float, rng: np.random.Generator) -> NDArray[np.float64]:
    """(6, n, n) steps and hollows on nodes (6, n, n, 3), with this deviation [m]."""
    cells = nodes.reshape(-1, 3) / ROUGHNESS_CELL_M
    (own,) = rng.spawn(1)  # drawn apart: shapes and places stay
    lattice = own.standard_normal((32, 32, 32))
    steps = map_coordinates(
        lattice, cells.T + own.uniform(0, 32, (3, 1)), order=1, mode="grid-wrap"
    )
    return np.asarray(height_m * (steps / np.std(steps)).reshape(nodes.shape[:3]))

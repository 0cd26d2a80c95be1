"""Small stones and low plants on natural ground and rocks: one mesh of many curved patches."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from airground.core.arrays import read_only
from sim.geometry.parts import Part
from sim.geometry.surface import Mesh, RayCaster, join
from sim.geometry.terrain import HeightField
from sim.scene import Terrain

MARGIN_M = 0.5
"""Cover reaches so far beyond the area with rocks, to the rim of what the MAV sees [m]."""
STONE_M = (0.02, 0.09)
"""Smallest and largest diameter: from coarse gravel to cobbles (ISO 14688) [m]."""
LEAF_M = (0.08, 0.2)
"""Shortest and longest leaf of a plant, as of plantain, dandelion or broad grass [m]."""
BLADE_M = (0.12, 0.35)
"""Shortest and longest blade of a tuft, as of a meadow before it is mown [m]."""
BLADE_WIDTH_M = (0.004, 0.009)
"""Narrowest and widest blade [m]."""
LEAVES = 8
"""Leaves of a plant, and blades of a tuft."""
STONE_NODES = (4, 4)
LEAF_NODES = (2, 4)
"""Rows and columns of nodes of a patch: as few as bend, for there are ten thousands."""
_LEAF_THICKNESS_M = 0.001
_SUNK = 0.25  # of a stone's half width: how far it lies in the ground


@dataclass(frozen=True, eq=False)
class GroundCover:
    """Patches that face outward, each a grid of nodes: rows go down, columns right.

    Attributes:
        stones: (S, *STONE_NODES, 3) nodes of the visible part of each stone, in `world` [m].
        leaves: (L, *LEAF_NODES, 3) nodes of the upper side of each leaf or blade, from its root to
            its tip, in `world` [m].
    """

    stones: NDArray[np.float64]
    leaves: NDArray[np.float64]

    def __post_init__(self) -> None:
        for name, nodes in (("stones", STONE_NODES), ("leaves", LEAF_NODES)):
            fixed = read_only(getattr(self, name), name, (None, *nodes, 3), np.float64)
            object.__setattr__(self, name, fixed)

    def undersides(self) -> NDArray[np.float64]:
        """(L, *LEAF_NODES, 3) nodes of the lower side of each leaf, which faces down."""
        return self.leaves[:, ::-1] - [0, 0, _LEAF_THICKNESS_M]

    def patches(self) -> tuple[NDArray[np.float64], ...]:
        """Stones, upper and lower sides of leaves: each (K, rows, columns, 3)."""
        return self.stones, self.leaves, self.undersides()

    def mesh(self) -> Mesh:
        """All patches in this order; no node is shared, for each patch has its own picture."""
        return join(_grids(patches) for patches in self.patches())

    def parts(self) -> list[Part]:
        """Stones and plants (also tufts) with all their leaves, in the order of the mesh."""
        stone, leaf = (
            2 * (rows - 1) * (columns - 1) for rows, columns in (STONE_NODES, LEAF_NODES)
        )
        stones = [Part(f"stone_{k:05d}", "stone", stone) for k in range(len(self.stones))]
        plants = [
            Part(f"plant_{k:05d}", "plant", leaf * LEAVES)
            for k in range(len(self.leaves) // LEAVES)
        ]
        return [*stones, *plants, *plants]  # upper sides, then lower sides


def grow_cover(
    terrain: Terrain, ground: HeightField, rocks: Sequence[Mesh], rng: np.random.Generator
) -> GroundCover:
    """Scatter the stones of `terrain` over the ground, plants and grass over ground and rocks."""
    area = np.minimum(np.array(terrain.area_m) + 2 * MARGIN_M, ground.size_m - 0.2)
    stones = _stones(round(terrain.stones_per_m2 * area.prod()), area, ground, rng)
    surface = join([ground.mesh(), *rocks])
    leaves = _leaves(round(terrain.plants_per_m2 * area.prod()), area, surface, rng)
    blades = _blades(round(terrain.grass_per_m2 * area.prod()), area, surface, rng)
    return GroundCover(stones, np.concatenate([leaves, blades]))


def patch_normals(patches: NDArray[np.float64]) -> NDArray[np.float64]:
    """(K, rows, columns, 3) outward unit normals of patches at their nodes."""
    normals = np.cross(np.gradient(patches, axis=1), np.gradient(patches, axis=2))
    return normals / np.maximum(np.linalg.norm(normals, axis=-1, keepdims=True), 1e-12)


def _grids(patches: NDArray[np.float64]) -> Mesh:
    count, rows, columns = patches.shape[:3]
    corner = (np.arange(rows - 1)[:, None] * columns + np.arange(columns - 1)[None]).ravel()
    # Seen from outside this winds counter-clockwise.
    first = np.stack([corner, corner + columns, corner + columns + 1], axis=1)
    second = np.stack([corner, corner + columns + 1, corner + 1], axis=1)
    offsets = np.arange(count)[:, None, None] * (rows * columns)
    triangles = offsets + np.concatenate([first, second])
    return patches.reshape(-1, 3), triangles.reshape(-1, 3)


def _stones(
    count: int, area: NDArray, ground: HeightField, rng: np.random.Generator
) -> NDArray[np.float64]:
    """Blocks with bevelled sides, each bent to a shape of its own, their rims below ground."""
    places = rng.uniform(-area / 2, area / 2, (count, 2))
    small, large = STONE_M
    # Many small, few large: a power law, as broken rock has.
    radii = 0.5 * small * (large / small) ** (rng.random(count) ** 1.5)
    u, v = _disc()
    # A disc pushed up to a super-ellipsoid: a flat top and steep sides.
    rise = np.sqrt(np.clip(1 - np.hypot(u, v) ** 3, 0, 1)) - _SUNK
    shape = np.stack([u, v, rise], axis=-1)
    stretch = rng.uniform([0.8, 0.6, 0.45], [1.2, 1.0, 1.0], (count, 3))
    dents = 1 + 0.12 * rng.standard_normal((count, *STONE_NODES, 1))
    nodes = shape * stretch[:, None, None] * dents
    nodes[..., 2] += 0.3 * rng.standard_normal((count, 1, 1)) * nodes[..., 0]  # a tilted top
    rim = np.ones(STONE_NODES, bool)
    rim[1:-1, 1:-1] = False
    nodes[:, rim, 2] = np.minimum(nodes[:, rim, 2], -_SUNK)
    angles = rng.uniform(0, 2 * np.pi, count)
    return _placed(nodes * radii[:, None, None, None], angles, places, ground.at(*places.T))


def _leaves(
    plants: int, area: NDArray, surface: Mesh, rng: np.random.Generator
) -> NDArray[np.float64]:
    """Leaves that rise from one place of a surface in all directions and droop."""
    count = plants * LEAVES
    places = np.repeat(rng.uniform(-area / 2, area / 2, (plants, 2)), LEAVES, axis=0)
    lengths = np.repeat(rng.uniform(*LEAF_M, plants), LEAVES) * rng.uniform(0.6, 1.0, count)
    rise = np.tan(np.radians(rng.uniform(10, 65, count)))[:, None, None]
    droop = rise * rng.uniform(0.3, 0.8, count)[:, None, None]
    width = rng.uniform(0.06, 0.14, count)[:, None, None]
    along, across = np.meshgrid(np.linspace(0, 1, LEAF_NODES[1]), np.linspace(1, -1, LEAF_NODES[0]))
    side = width * across * (np.sin(np.pi * along**0.8) + 0.05)
    up = rise * along - droop * along**2
    nodes = np.stack(np.broadcast_arrays(along, side, up), axis=-1)
    nodes /= np.sqrt(1 + rise**2)[..., None]  # lengths count along the slope
    angles = rng.uniform(0, 2 * np.pi, count)
    heights = _heights(surface, places)
    return _placed(nodes * lengths[:, None, None, None], angles, places, heights)


def _blades(
    tufts: int, area: NDArray, surface: Mesh, rng: np.random.Generator
) -> NDArray[np.float64]:
    """Narrow blades that rise from about one place of a surface and bend over at the tip."""
    count = tufts * LEAVES
    places = np.repeat(rng.uniform(-area / 2, area / 2, (tufts, 2)), LEAVES, axis=0)
    places += rng.normal(0, 0.015, (count, 2))
    lengths = np.repeat(rng.uniform(*BLADE_M, tufts), LEAVES) * rng.uniform(0.5, 1.0, count)
    lean = np.tan(np.radians(rng.uniform(5, 42, count)))[:, None, None]
    bend = rng.uniform(0.1, 0.4, count)[:, None, None]
    width = (rng.uniform(*BLADE_WIDTH_M, count) / lengths)[:, None, None]
    along, across = np.meshgrid(np.linspace(0, 1, LEAF_NODES[1]), np.linspace(1, -1, LEAF_NODES[0]))
    out = lean * along + bend * along**2
    side = width * across * (1 - 0.9 * along**2)
    nodes = np.stack(np.broadcast_arrays(out, side, along - 0.5 * bend * along**2), axis=-1)
    nodes /= np.sqrt(1 + (lean + bend) ** 2)[..., None]
    angles = rng.uniform(0, 2 * np.pi, count)
    heights = _heights(surface, places)
    return _placed(nodes * lengths[:, None, None, None], angles, places, heights)


def _heights(surface: Mesh, places: NDArray) -> NDArray[np.float64]:
    """(K,) height of the highest surface at places (K, 2) [m]."""
    if len(places) == 0:
        return np.empty(0)
    above = float(surface[0][:, 2].max()) + 1.0
    rays = np.zeros((len(places), 6), np.float32)
    rays[:, :2], rays[:, 2], rays[:, 5] = places, above, -1.0
    return above - RayCaster(surface).hits(rays)[0].astype(np.float64)


def _placed(
    nodes: NDArray, angles: NDArray, places: NDArray, heights: NDArray
) -> NDArray[np.float64]:
    """Patches turned about the vertical by `angles` (K,) [rad], put at `places` (K, 2) and
    `heights` (K,)."""
    c, s = np.cos(angles)[:, None, None], np.sin(angles)[:, None, None]
    x, y = nodes[..., 0], nodes[..., 1]
    turned = np.stack([c * x - s * y, s * x + c * y, nodes[..., 2]], axis=-1)
    turned[..., :2] += places[:, None, None]
    turned[..., 2] += heights[:, None, None]
    return turned


def _disc() -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """x and y of a square grid pressed onto the unit disc."""
    x, y = np.meshgrid(np.linspace(-1, 1, STONE_NODES[1]), np.linspace(1, -1, STONE_NODES[0]))
    return x * np.sqrt(1 - y**2 / 2), y * np.sqrt(1 - x**2 / 2)

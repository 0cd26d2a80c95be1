"""Section VI's stages as work: on the height maps of one surface and of the ground map."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from airground.config import Config, paper
from airground.core.belief import HeightMap
from airground.localization.cost_map import overlay_at, overlay_turned, reach_of
from airground.localization.height_map import aerial_height_map, ground_height_map
from airground.localization.hypotheses import CostVolume, search_headings, search_positions
from airground.localization.particles import resample, weights
from evaluation.bench import floors
from evaluation.bench.material import Material
from evaluation.bench.row import Floor, Work

PAPER_SEARCH_M = (4.0, 5.0)
"""What the paper timed; the product searches squares, so one of the same area is timed here."""
CLOUD_OF_PARTICLES_M = 0.3
"""Standard deviation of the particles' places about the right one [m]."""


@dataclass
class Maps:
    """Both height maps of one surface.

    Attributes:
        material: Whose clouds they are of.
        config: Resolution, cost, and search region.
        heading: That the aerial map is turned by [rad].
    """

    material: Material
    config: Config
    heading: float
    aerial: HeightMap = field(init=False)
    ground: HeightMap = field(init=False)

    def __post_init__(self) -> None:
        self.aerial, self.ground = self.make()

    def make(self) -> tuple[HeightMap, HeightMap]:
        """The aerial map about its camera, and the ground map as far as one could lie on it."""
        surface, config = self.material.surface, self.config
        position = np.array(surface.T_mav_camera.translation)
        aerial = aerial_height_map(
            surface.cloud_mav.points, position, self.heading, config.height_maps
        )
        reach_m = float(np.linalg.norm(reach_of(aerial), axis=1).max() + 2) / aerial.cells_per_m
        ground = ground_height_map(
            self.material.ground_cloud.points,
            self.material.robot_position,
            config.localization.search_radius_m + reach_m,
            config.height_maps,
        )
        return aerial, ground

    @property
    def offsets(self) -> int:
        """Searched a side."""
        side = 2 * self.config.localization.search_radius_m * self.aerial.cells_per_m
        return math.floor(side + 1e-6) + 1

    @property
    def size(self) -> str:
        nx, ny = self.aerial.heights.shape
        return (
            f"{self.offsets} x {self.offsets} offsets at {self.aerial.cells_per_m:g} cells/m, "
            f"aerial map of {nx} x {ny} cells"
        )

    def searched_cells(self, reach: tuple[int, ...]) -> int:
        """Of the searched square, widened by an aerial map of that many cells."""
        return math.prod(self.offsets + n - 1 for n in reach)

    def floor(self) -> Floor:
        """Of the cost map."""
        return floors.cost_map(self.searched_cells(self.aerial.heights.shape))

    def search(self) -> CostVolume:
        """The cost of every position."""
        return search_positions(
            self.aerial,
            self.ground,
            self.material.robot_position,
            self.heading,
            self.config.localization,
        )

    def poses(self, count: int) -> NDArray[np.float64]:
        """(count, 3) particles about the right place."""
        rng = np.random.default_rng(0)
        surface = self.material.surface
        place = (self.material.T_ground_mav @ surface.T_mav_camera.translation)[:2]
        poses = np.empty((count, 3))
        poses[:, :2] = rng.normal(place, CLOUD_OF_PARTICLES_M, (count, 2))
        poses[:, 2] = rng.normal(self.material.heading, 0.1, count)
        return poses


def paper_sized(**localization: object) -> Config:
    """The published constants, with the searched area that the paper timed."""
    config = paper()
    update = {"search_radius_m": math.sqrt(math.prod(PAPER_SEARCH_M)) / 2, **localization}
    return config.model_copy(update={"localization": config.localization.model_copy(update=update)})


def cost_map(material: Material) -> Work:
    maps = Maps(material, paper_sized(), material.heading)
    return Work(maps.search, size=f"{maps.size}, ZMSSD", floor=maps.floor())


def cost_map_correlation(material: Material) -> Work:
    maps = Maps(material, paper_sized(cost="ncc"), material.heading)
    return Work(maps.search, size=f"{maps.size}, correlation", floor=maps.floor())


def heading_search(material: Material) -> Work:
    maps = Maps(material, paper_sized(heading="search"), 0.0)
    config = maps.config.localization

    def search() -> object:
        return search_headings(maps.aerial, maps.ground, material.robot_position, config)

    volume = search_headings(maps.aerial, maps.ground, material.robot_position, config)
    # Turned, the aerial map reaches as far as its farthest cell, on all sides.
    reach = 2 * math.ceil(np.linalg.norm(reach_of(maps.aerial), axis=1).max()) + 1
    cells = maps.searched_cells((reach, reach))
    size = f"{config.headings} headings ({len(volume.headings)} looked at), {maps.size}"
    return Work(search, size=size, floor=floors.heading_search(cells, len(volume.headings)))


def particles(material: Material, count: int | None = None) -> Work:
    """Weigh the particles by Eq. 5 and draw them anew, heading known."""
    maps = Maps(material, paper_sized(), material.heading)
    config = maps.config.localization
    poses, rng = maps.poses(count or config.particles), np.random.default_rng(0)

    def update() -> object:
        costs = overlay_at(maps.aerial, maps.ground, poses[:, :2]).costs(config)
        return poses[resample(weights(costs, config.sigma), rng)]

    return _particle_work(maps, update, len(poses), turned=False)


def particles_heading(material: Material) -> Work:
    """The same where each particle has a heading."""
    maps = Maps(material, paper_sized(heading="search"), 0.0)
    config = maps.config.localization
    poses, rng = maps.poses(config.particles), np.random.default_rng(0)

    def update() -> object:
        costs = overlay_turned(maps.aerial, maps.ground, poses).costs(config)
        return poses[resample(weights(costs, config.sigma), rng)]

    return _particle_work(maps, update, len(poses), turned=True)


def _particle_work(maps: Maps, update: Callable[[], object], count: int, turned: bool) -> Work:
    cells = maps.aerial.filled_cells
    size = f"{count} particles, {cells} filled cells at {maps.aerial.cells_per_m:g} cells/m"
    return Work(update, size=size, floor=floors.particles(cells, count, turned))


def height_maps(material: Material) -> Work:
    """Both maps, as `best` makes them for each surface."""
    maps = Maps(material, material.config, material.heading)
    points = len(material.surface.cloud_mav), len(material.ground_cloud)
    cells = maps.aerial.heights.size + maps.ground.heights.size
    size = f"{points[0]} and {points[1]} points, {maps.aerial.cells_per_m:g} cells/m"
    return Work(maps.make, size=size, floor=floors.height_map(sum(points), cells))

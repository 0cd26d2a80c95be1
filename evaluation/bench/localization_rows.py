"""Work of Sections VI and VII: one aerial surface located in the ground map, and refined."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from airground.augmentation import Augmentation
from airground.config import Config, paper
from airground.core.cloud import PointCloud
from airground.core.se3 import SE3
from airground.localization.channel_kernels import CHANNELS, SHIFTS
from airground.localization.channels import ChannelOverlay, stride_of
from airground.localization.cost_map import reach_of
from airground.localization.height_map_pair import HeightMapPair
from airground.localization.hypotheses import CostVolume, search_headings, search_positions
from airground.localization.particles import resample, weights
from airground.pipeline import moved, pair_of
from airground.refinement import refine
from evaluation.bench import floors
from evaluation.bench.material import Material
from evaluation.bench.work import Work
from evaluation.setup.published import START_NOISE_DEG, START_NOISE_M
from evaluation.setup.setups import with_localization

PAPER_RADIUS_M = math.sqrt(4.0 * 5.0) / 2
"""Half the side of the square that is timed, of the area that the paper timed: 4 x 5 m."""
CLOUD_OF_PARTICLES_M, CLOUD_OF_PARTICLES_RAD = 0.3, 0.1
"""Standard deviation of the particles about the right place and heading: a belief that has
nearly converged."""
SLANTED = np.ones(3) / np.sqrt(3.0)
"""The start of refinement is shifted and turned along this axis: all six directions count."""


class Maps:
    """Both height maps of one surface."""

    def __init__(self, material: Material, config: Config) -> None:
        self.material, self.config = material, config
        self.pair = self.make()
        self.aerial, self.ground = self.pair.aerial, self.pair.ground

    def make(self) -> HeightMapPair:
        """The aerial map about its camera, and the ground map as far as the search reaches."""
        sighting = replace(self.material.sighting, heading=self.material.heading)
        pair = pair_of(sighting, self.config)
        _ = pair.ground  # computes both
        return pair

    @property
    def size(self) -> str:
        (nx, ny), offsets = self.aerial.heights.shape, self._offsets
        return (
            f"{offsets} x {offsets} offsets at {self.aerial.cells_per_m:g} cells/m, "
            f"aerial map of {nx} x {ny} cells"
        )

    @property
    def _offsets(self) -> int:
        side = 2 * self.config.localization.search_radius_m * self.aerial.cells_per_m
        return math.floor(side + 1e-6) + 1

    @property
    def looked_at(self) -> int:
        """One in so many cells along x and along y, by the cost of channels."""
        return stride_of(self.aerial.cells_per_m)

    def searched_cells(self, reach: tuple[int, ...]) -> int:
        """Cells of the searched square, widened by an aerial map of this shape."""
        return math.prod(self._offsets + n - 1 for n in reach)

    def search(self) -> CostVolume:
        """The cost of every position, and of every heading where it is searched."""
        robot = self.material.sighting.T_ground_camera.translation[:2]
        config = self.config.localization
        if self.pair.searched:
            return search_headings(self.aerial, self.ground, robot, config)
        return search_positions(self.aerial, self.ground, robot, self.pair.turn, config)

    def poses(self, count: int) -> NDArray[np.float64]:
        """(count, 3) particles about the right place: x, y [m] and heading [rad]."""
        rng = np.random.default_rng(0)
        surface = self.material.surface
        place = (self.material.T_ground_mav @ surface.T_mav_camera.translation)[:2]
        poses = np.empty((count, 3))
        poses[:, :2] = rng.normal(place, CLOUD_OF_PARTICLES_M, (count, 2))
        poses[:, 2] = rng.normal(self.material.heading, CLOUD_OF_PARTICLES_RAD, count)
        return poses


def paper_sized(**localization: object) -> Config:
    """The published constants, with the searched area that the paper timed."""
    return with_localization(paper(), **{"search_radius_m": PAPER_RADIUS_M, **localization})


def best_sized(material: Material, **localization: object) -> Config:
    """The constants of `best`, with that area."""
    return with_localization(material.config, **{"search_radius_m": PAPER_RADIUS_M, **localization})


def height_maps(material: Material) -> Work:
    """Both maps, as `best` makes them for each surface."""
    maps = Maps(material, material.config)
    points = len(material.surface.cloud_mav), len(material.ground_cloud)
    cells = maps.aerial.heights.size + maps.ground.heights.size
    size = f"{points[0]} and {points[1]} points, {maps.aerial.cells_per_m:g} cells/m"
    return Work(maps.make, size=size, floor=floors.height_map(sum(points), cells))


def cost_map(material: Material) -> Work:
    return _cost_map(Maps(material, paper_sized()), "ZMSSD")


def cost_map_correlation(material: Material) -> Work:
    return _cost_map(Maps(material, paper_sized(cost="ncc")), "correlation")


def _cost_map(maps: Maps, cost: str) -> Work:
    floor = floors.cost_map(maps.searched_cells(maps.aerial.heights.shape))
    return Work(maps.search, size=f"{maps.size}, {cost}", floor=floor)


def cost_map_channels(material: Material) -> Work:
    """The cost of `best`, at its resolution, over the area that the paper timed."""
    maps = Maps(material, best_sized(material))
    cells = maps.searched_cells(maps.aerial.heights.shape) / maps.looked_at**2
    floor = floors.cost_map_channels(cells, CHANNELS, len(SHIFTS))
    return Work(maps.search, size=f"{maps.size}, channels", floor=floor)


def heading_search_channels(material: Material) -> Work:
    maps = Maps(material, best_sized(material, heading="search"))
    searched = len(maps.search().headings)
    size = f"{maps.config.localization.headings} headings ({searched} looked at), {maps.size}"
    return Work(maps.search, size=f"{size}, channels")


def particles_channels(material: Material) -> Work:
    """Weigh and draw the particles of `best`, each with a heading."""
    maps = Maps(material, best_sized(material, heading="search"))
    config, rng = maps.config.localization, np.random.default_rng(0)
    poses = maps.poses(config.particles)

    def update() -> object:
        costs = ChannelOverlay.of(maps.aerial, maps.ground).costs(poses, config)
        return poses[resample(weights(costs, config.sigma), rng)]

    cells = maps.aerial.filled_cells // maps.looked_at**2
    return Work(update, size=f"{len(poses)} particles, {cells} filled cells that are looked at")


def heading_search(material: Material) -> Work:
    maps = Maps(material, paper_sized(heading="search"))
    searched = len(maps.search().headings)
    # Turned, the aerial map reaches as far as its farthest cell, on all sides.
    reach = 2 * math.ceil(np.linalg.norm(reach_of(maps.aerial), axis=1).max()) + 1
    floor = floors.heading_search(maps.searched_cells((reach, reach)), searched)
    size = f"{maps.config.localization.headings} headings ({searched} looked at), {maps.size}"
    return Work(maps.search, size=size, floor=floor)


def particles(material: Material, count: int | None = None) -> Work:
    """Weigh the particles by Eq. 5 and draw them anew, heading known."""
    return _particles(Maps(material, paper_sized()), count)


def particles_heading(material: Material) -> Work:
    """The same where each particle has a heading."""
    return _particles(Maps(material, paper_sized(heading="search")))


def _particles(maps: Maps, count: int | None = None) -> Work:
    config = maps.config.localization
    poses, rng = maps.poses(count or config.particles), np.random.default_rng(0)

    def update() -> object:
        costs = maps.pair.overlay(poses).costs(config)
        return poses[resample(weights(costs, config.sigma), rng)]

    cells = maps.aerial.filled_cells
    size = f"{len(poses)} particles, {cells} filled cells at {maps.aerial.cells_per_m:g} cells/m"
    floor = floors.particles(cells, len(poses), maps.pair.searched)
    return Work(update, size=size, floor=floor)


def start_of(material: Material) -> SE3:
    """The start of refinement: the paper's 0.2 m and 3 degrees off, about the cloud's middle."""
    right = material.T_ground_mav
    centre = right @ material.surface.cloud_mav.points.mean(axis=0, dtype=np.float64)
    turn = SE3.from_rotation_vector(np.deg2rad(START_NOISE_DEG.value) * SLANTED)
    shift = START_NOISE_M.value * SLANTED + centre - turn @ centre
    return SE3(turn.rotation, shift) @ right


def _refinement(material: Material, config: Config, ground: PointCloud) -> Work:
    surface, start = material.surface, start_of(material)
    size = f"{len(surface.cloud_mav)} on {len(ground)} points"
    return Work(
        lambda: refine(surface.stamp_ns, start, surface.cloud_mav, ground, config), size=size
    )


def icp(material: Material) -> Work:
    """As published: with its preparation, without the search for a better start."""
    return _refinement(material, paper(), material.ground_cloud)


def refinement(material: Material, ground: PointCloud | None = None) -> Work:
    """As `best` does it: the height maps give a start, then ICP. None: the material's map."""
    return _refinement(material, material.config, ground or material.ground_cloud)


def augmentation(material: Material) -> Work:
    surface, motion = material.surface, material.T_ground_mav
    voxels = Augmentation(material.config.ground_mapping.voxel_m)

    def augment() -> object:
        voxels.add(surface, motion)
        return moved(surface.cloud_mav, motion)

    points = len(surface.cloud_mav)
    return Work(augment, size=f"{points} points", floor=floors.added_points(points))

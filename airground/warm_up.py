"""Compiles the kernels above tracking before the first frame arrives."""

from __future__ import annotations

import numpy as np

from airground.config import Config, GroundMapping
from airground.core.camera import PinholeCamera
from airground.core.cloud import PointCloud
from airground.core.compile_once import compiling_once
from airground.core.messages import GroundImage
from airground.core.se3 import SE3, rotation_angle
from airground.core.surface import DepthMap
from airground.dense.depth_refinement import depth_from_costs
from airground.dense.distance_field import FieldHistogram
from airground.dense.fusion import Fusion
from airground.dense.plane_sweep import PlaneSweep, inverse_depth_planes
from airground.dense.ray_casting import cast_surface, surface_cloud
from airground.dense.volume import Volume
from airground.ground_map.fused_map import GroundMap
from airground.localization.height_map_pair import HeightMapPair
from airground.localization.particle_filter import MonteCarloLocalizer
from airground.refinement.alignment import refine

SIDE_M = 1.0
"""Half the side of the surface that is located and aligned [m]."""
POINTS_PER_SIDE = 60
"""Points of that surface per side: about one per cell of a height map."""


def warm_up_mapping(config: Config, rng: np.random.Generator) -> None:
    """Compile everything above tracking; `slam.warm_up` does the same for tracking."""
    with compiling_once("mapping"):
        warm_up_dense(config)
        warm_up_ground_map()
        warm_up_localization(config, rng)
        warm_up_refinement(config)


def warm_up_dense(config: Config) -> None:
    """Take a small uniform image through all stages of Section V."""
    camera = PinholeCamera(64, 48, 40.0, 40.0, 31.5, 23.5)
    image = np.full((48, 64), 100, np.uint8)
    planes = inverse_depth_planes(1.0, 2.0, 32)
    sides = 2 if config.view_selection.both_sides else 1
    sweep = PlaneSweep(image, camera, SE3.identity(), planes, config.plane_sweep, sides)
    for side in range(sides):
        sweep.add(image, SE3(np.eye(3), np.array([0.1, 0, 0])), side)
    depth_from_costs(sweep, config.plane_sweep)
    flat = np.full((24, 32), 1.5, np.float32)
    depth_map = DepthMap(0, sweep.camera, SE3.identity(), flat, image[:24, :32], 1)
    volume = Volume.around([depth_map], depth_map, (32, 24, 16), config.fusion.truncation_m)
    histogram = FieldHistogram(volume, config.fusion.truncation_m)
    histogram.add(depth_map)
    phi = Fusion(config.fusion.data_weight, 1).fuse(histogram.counts)
    depth, normals = cast_surface(volume, phi, histogram.counts, 1, config.fusion.truncation_m)
    surface_cloud(volume, depth, normals, depth_map)


def warm_up_ground_map() -> None:
    """Measure how far a pose has turned, and map a wall."""
    pose = SE3.identity()
    rotation_angle(pose.rotation.T @ pose.rotation)
    ground_map = GroundMap(PinholeCamera(32, 24, 30.0, 30.0, 15.5, 11.5), GroundMapping())
    wall = np.ones((24, 32), np.float32)
    ground_map.add(GroundImage(0, np.zeros((24, 32, 3), np.uint8), wall), pose)
    ground_map.cloud()


def warm_up_localization(config: Config, rng: np.random.Generator) -> None:
    """Locate a bump on itself twice: with particles to draw, then with particles to move."""
    few = {"search_radius_m": 0.2, "headings": 4}
    localization = config.localization.model_copy(update=few)
    small = config.model_copy(update={"localization": localization})
    localizer = MonteCarloLocalizer(small, rng)
    points = _bump().points
    for stamp_ns in range(2):
        pair = HeightMapPair(stamp_ns, points, np.zeros(3), points, np.zeros(2), 0.0, small)
        for _ in localizer.update(pair):
            pass


def warm_up_refinement(config: Config) -> None:
    """Align a bump with itself."""
    cloud = _bump()
    refine(0, SE3.identity(), cloud, cloud, config)


def _bump() -> PointCloud:
    """A bump on a plane of 2 x 2 m; read-only, as clouds are, since kernels compile for that."""
    x, y = np.meshgrid(*[np.linspace(-SIDE_M, SIDE_M, POINTS_PER_SIDE)] * 2)
    points = np.column_stack([x.ravel(), y.ravel(), np.exp(-4 * (x**2 + y**2)).ravel()])
    return PointCloud(points.astype(np.float32), np.zeros((len(points), 3), np.uint8))

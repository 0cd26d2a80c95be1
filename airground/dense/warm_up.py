"""Compiles every kernel of the room, so that the first frame of a flight is not slow."""

from __future__ import annotations

import numpy as np

from airground.config import Config
from airground.core.camera import PinholeCamera
from airground.core.se3 import SE3
from airground.core.surface import DepthMap
from airground.dense.depth_refinement import depth_from_costs
from airground.dense.distance_field import FieldHistogram
from airground.dense.fusion import Fusion
from airground.dense.plane_sweep import PlaneSweep, inverse_depth_planes
from airground.dense.ray_casting import cast_surface, surface_cloud
from airground.dense.volume import Volume


def warm_up_dense(config: Config) -> None:
    """Takes a postage stamp of nothing through all stages."""
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

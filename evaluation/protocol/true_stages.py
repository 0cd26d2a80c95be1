"""Sightings in which one stage's result is replaced by the truth, for the error budget."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import open3d as o3d

from airground.core.cloud import PointCloud
from airground.pipeline import Sighting
from evaluation.truth.relation import true_T_ground_mav
from sim.truth import Truth


def with_true_surface(sighting: Sighting, truth: Truth) -> Sighting:
    """The aerial surface is what its camera truly had before it, without a hole or an error.

    It hangs on the pose that the MAV believes in: errors of poses stay.
    """
    surface = sighting.surface
    T_world_camera = truth.T_world_mav_camera(surface.reference_stamp_ns)
    depth = truth.cast(surface.camera, T_world_camera)
    seen = np.isfinite(depth)
    points = surface.camera.rays()[seen] * depth[seen][:, None]
    cloud = PointCloud(
        (surface.T_mav_camera @ points).astype(np.float32),
        np.full((len(points), 3), 128, np.uint8),
    )
    return replace(sighting, surface=replace(surface, depth=depth, cloud_mav=cloud))


def with_true_ground_map(sighting: Sighting, truth: Truth) -> Sighting:
    """Every point of the ground map lies on the true surface, where that is nearest.

    What was seen stays the same; noise, and drift across the surfaces, goes.
    """
    T_world_camera = truth.T_world_ground_camera(sighting.ground_stamp_ns)
    T_world_ground = T_world_camera @ sighting.T_ground_camera.inverse()
    points_world = (T_world_ground @ sighting.ground_cloud.points).astype(np.float32)
    nearest = truth.surface.compute_closest_points(o3d.core.Tensor.from_numpy(points_world))
    points = T_world_ground.inverse() @ nearest["points"].numpy().astype(np.float64)
    cloud = PointCloud(points.astype(np.float32), sighting.ground_cloud.colours)
    return replace(sighting, ground_cloud=cloud)


def with_true_heading(sighting: Sighting, truth: Truth) -> Sighting:
    """The turn between the maps is known exactly."""
    return replace(sighting, heading=true_T_ground_mav(sighting, truth).heading())

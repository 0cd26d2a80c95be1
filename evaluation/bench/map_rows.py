"""Refinement, augmentation, the ground map and decoding as work (Sec. IV and VII)."""

from __future__ import annotations

import itertools
from collections.abc import Callable

import numpy as np

from airground.augmentation import Augmentation
from airground.config import Config, paper
from airground.core.cloud import PointCloud
from airground.core.se3 import SE3
from airground.ground_map import GroundMap
from airground.ground_map.surface_points import surface_points
from airground.pipeline import moved
from airground.refinement import refine
from evaluation.bench import floors
from evaluation.bench.material import Material
from evaluation.bench.row import Work
from evaluation.setup.published import START_NOISE_DEG, START_NOISE_M

SLANTED = np.ones(3) / np.sqrt(3.0)
"""Along this axis the start is shifted and turned: all six directions are to be found."""
DECODED = 60
"""So many images are read in turn: some tens of MB, which the system keeps in memory."""


def start_of(material: Material) -> SE3:
    """Where refinement starts: the paper's 0.2 m and 3 degrees away, about the cloud's middle."""
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
    """With its preparation, without the search for a better start: as published."""
    return _refinement(material, paper(), material.ground_cloud)


def refinement(material: Material, ground: PointCloud | None = None) -> Work:
    """As `best` does it: the height maps give a start, then ICP.

    Args:
        material: The surface.
        ground: The map; that of the material where None.
    """
    return _refinement(material, material.config, ground or material.ground_cloud)


def augmentation(material: Material) -> Work:
    surface, motion = material.surface, material.T_ground_mav
    voxels = Augmentation(material.config.ground_mapping.voxel_m)

    def augment() -> object:
        voxels.add(surface, motion)
        return moved(surface.cloud_mav, motion)

    points = len(surface.cloud_mav)
    return Work(augment, size=f"{points} points", floor=floors.added_points(points))


def ground_map(material: Material) -> Work:
    """One keyframe: packed, and fused into the distance field."""
    image, pose = material.ground_image, material.sighting.T_ground_camera
    built = GroundMap(material.ground_camera, material.config.ground_mapping)
    height, width = image.depth.shape
    return Work(lambda: built.add(image, pose), size=f"{width} x {height} px")


def ground_surface(material: Material) -> Work:
    """The ground map's points, colours and normals from its distance field."""
    field = material.ground_field
    least = material.config.ground_mapping.min_keyframes - 0.5
    points = len(surface_points(field, least))
    return Work(
        lambda: surface_points(field, least),
        size=f"{len(field.rows)} blocks, {points} points",
        floor=floors.ground_surface(field.tsdf.size, points),
    )


def read_grey(material: Material) -> Work:
    recording = material.recording
    camera = material.mav_camera
    read = _in_turn(recording.read_mav_image, len(recording.mav_camera_stamps))
    return Work(read, size=f"{camera.width} x {camera.height} px, grey PNG")


def read_colour_depth(material: Material) -> Work:
    recording = material.recording
    camera = material.ground_camera
    read = _in_turn(recording.read_ground_image, len(recording.ground_camera_stamps))
    return Work(read, size=f"{camera.width} x {camera.height} px, colour and depth PNG")


def _in_turn(read: Callable[[int], object], count: int) -> Callable[[], object]:
    indices = itertools.cycle(range(0, count, max(1, count // DECODED)))
    return lambda: read(next(indices))

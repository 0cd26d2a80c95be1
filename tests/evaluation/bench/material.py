"""A small surface of a synthetic heap, with all that the rows of the benchmark work on."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from airground.config import Config, Fusion, PlaneSweep
from airground.core.camera import PinholeCamera
from airground.core.cloud import PointCloud
from airground.core.messages import GroundImage
from airground.core.se3 import SE3
from airground.core.sighting import Sighting
from airground.core.surface import AerialSurface, DepthMap
from airground.dense.view_selection import PosedImage
from airground.ground_map import GroundMap
from airground.io.recording import Recording
from airground.pipeline import moved
from evaluation.bench.material import Material
from tests.dense.synthetic import DOWN, SMALL_CAMERA, World, flight, heap_world, noisy
from tests.io.recordings import write_recording

T_GROUND_MAV = SE3.from_heading(0.4, (1.0, 2.0, 0.3))
WIDE_CAMERA = PinholeCamera(240, 180, 90.0, 90.0, 119.5, 89.5)
CONFIG = Config(
    plane_sweep=PlaneSweep(hypotheses=32), fusion=Fusion(voxels=(120, 80, 48), truncation_m=0.12)
)
FRAMES, MIDDLE = 13, 6


def make_material(folder: Path) -> Material:
    """13 views of a heap, three depth maps of them, and the heap's tops as the ground map."""
    rng = np.random.default_rng(5)
    world = heap_world(boxes=30)
    poses = flight(FRAMES)
    views = [
        PosedImage(stamp, noisy(world.grey(SMALL_CAMERA, pose, 1), rng), pose)
        for stamp, pose in enumerate(poses)
    ]
    depth_maps = [_depth_map(world, poses[i], i, rng) for i in (0, MIDDLE, FRAMES - 1)]
    middle = depth_maps[1]
    surface = AerialSurface(
        FRAMES,
        MIDDLE,
        middle.camera,
        middle.T_mav_camera,
        middle.depth,
        _cloud(middle.camera, middle.T_mav_camera, middle.depth),
        len(depth_maps),
    )
    above = SE3(DOWN, np.array([0.1, 0.1, 3.0]))
    ground = _cloud(WIDE_CAMERA, above, world.depth(WIDE_CAMERA, above))
    T_ground_camera = T_GROUND_MAV @ above
    depth = world.depth(WIDE_CAMERA, above).astype(np.float32)
    colour = np.full((*depth.shape, 3), 120, np.uint8)
    image = GroundImage(FRAMES, colour, depth)
    ground_map = GroundMap(WIDE_CAMERA, CONFIG.ground_mapping)
    for _ in range(CONFIG.ground_mapping.min_keyframes):
        ground_map.add(image, T_ground_camera)
    return Material(
        recording=Recording.open(write_recording(folder)),
        config=CONFIG,
        mav_camera=SMALL_CAMERA,
        ground_camera=WIDE_CAMERA,
        depth_maps=depth_maps,
        reference=views[MIDDLE],
        views=[*views[:MIDDLE], *views[MIDDLE + 1 :]],
        sighting=Sighting(
            surface,
            moved(ground, T_GROUND_MAV),
            FRAMES,
            poses[-1],
            FRAMES,
            T_ground_camera,
            T_GROUND_MAV.heading(),
        ),
        T_ground_mav=T_GROUND_MAV,
        ground_image=image,
        ground_field=ground_map.field(),
    )


def _depth_map(world: World, pose: SE3, stamp_ns: int, rng: np.random.Generator) -> DepthMap:
    camera = SMALL_CAMERA.halved()
    depth = world.depth(camera, pose) + rng.normal(0, 0.003, (camera.height, camera.width))
    image = np.full(depth.shape, 100, np.uint8)
    return DepthMap(stamp_ns, camera, pose, depth.astype(np.float32), image, 8)


def _cloud(camera: PinholeCamera, T_mav_camera: SE3, depth: np.ndarray) -> PointCloud:
    points = (T_mav_camera @ camera.back_project(depth).reshape(-1, 3)).astype(np.float32)
    return PointCloud(points, np.full(points.shape, 100, np.uint8))

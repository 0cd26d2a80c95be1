"""The ground map on a world whose truth is a plane and a step."""

import numpy as np
import pytest

from airground.config import GroundMapping
from airground.core.camera import PinholeCamera
from airground.core.messages import GroundImage
from airground.core.se3 import SE3
from airground.ground_map import GroundMap

CAMERA = PinholeCamera(160, 120, 130.0, 130.0, 79.5, 59.5)
# Looking along x, z up: camera x is -y, camera y is -z, camera z is x.
FORWARD = np.array([[0, 0, 1], [-1, 0, 0], [0, -1, 0]], float)


def wall_image(distance: float, noise: float = 0.0, seed: int = 0) -> GroundImage:
    depth = np.full((120, 160), distance, np.float32)
    depth += np.random.default_rng(seed).normal(0, noise, depth.shape).astype(np.float32)
    return GroundImage(0, np.full((120, 160, 3), 90, np.uint8), depth)


def test_a_wall_comes_back_where_it_stands() -> None:
    ground_map = GroundMap(CAMERA, GroundMapping())
    for x in (0.0, 0.5):
        ground_map.add(wall_image(2.0 - x), SE3(FORWARD, np.array([x, 0.3, 0.7])))
    points = ground_map.cloud().points
    assert np.allclose(points[:, 0], 2.0, atol=1e-5)
    assert points[:, 1].mean() == pytest.approx(0.3, abs=0.02)
    assert points[:, 2].mean() == pytest.approx(0.7, abs=0.02)


def test_averaging_beats_the_noise_of_one_frame() -> None:
    ground_map = GroundMap(CAMERA, GroundMapping(voxel_m=0.2, min_points=50))
    for seed in range(20):
        ground_map.add(wall_image(2.09, noise=0.01, seed=seed), SE3(FORWARD, np.zeros(3)))
    assert np.abs(ground_map.cloud().points[:, 0] - 2.09).max() < 0.003


def test_far_missing_and_silhouette_depth_stay_out() -> None:
    depth = np.full((120, 160), 2.0, np.float32)
    depth[:, :40] = 9.0
    depth[:, 80:120] = 1.0
    depth[:, 120:] = np.nan
    ground_map = GroundMap(CAMERA, GroundMapping(min_points=1, voxel_m=0.005))
    ground_map.add(GroundImage(0, np.zeros((120, 160, 3), np.uint8), depth), SE3.identity())
    z = ground_map.cloud().points[:, 2]
    assert set(np.round(z, 3)) == {1.0, 2.0}
    columns = CAMERA.project(ground_map.cloud().points)[:, 0]
    assert columns.min() > 40.5  # one pixel beside the jump at 40 is dropped
    assert not ((columns > 78.5) & (columns < 80.5)).any()


def test_keyframes_follow_motion() -> None:
    ground_map = GroundMap(CAMERA, GroundMapping(keyframe_distance_m=0.1, keyframe_angle_deg=5))
    assert ground_map.wants(SE3.identity())
    ground_map.add(wall_image(2.0), SE3.identity())
    assert not ground_map.wants(SE3.from_heading(np.deg2rad(4.9), [0.09, 0, 0]))
    assert ground_map.wants(SE3.from_heading(0.0, [0.11, 0, 0]))
    assert ground_map.wants(SE3.from_heading(np.deg2rad(5.1)))

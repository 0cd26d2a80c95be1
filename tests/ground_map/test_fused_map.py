"""The ground map on a world whose truth is a plane and a step."""

import numpy as np
import pytest

from airground.config import GroundMapping
from airground.core.camera import PinholeCamera
from airground.core.messages import GroundImage
from airground.core.se3 import SE3
from airground.core.trajectory import Trajectory
from airground.ground_map import GroundMap
from airground.ground_map.keyframe import GroundKeyframe

CAMERA = PinholeCamera(160, 120, 130.0, 130.0, 79.5, 59.5)
# Looking along x, z up: camera x is -y, camera y is -z, camera z is x.
FORWARD = np.array([[0, 0, 1], [-1, 0, 0], [0, -1, 0]], float)


def wall_image(distance: float, noise: float = 0.0, seed: int = 0) -> GroundImage:
    depth = np.full((120, 160), distance, np.float32)
    depth += np.random.default_rng(seed).normal(0, noise, depth.shape).astype(np.float32)
    return GroundImage(0, np.full((120, 160, 3), 90, np.uint8), depth)


def test_a_wall_comes_back_where_it_stands() -> None:
    ground_map = GroundMap(CAMERA, GroundMapping(min_keyframes=2))
    for x in (0.0, 0.5, 0.7):
        ground_map.add(wall_image(2.007 - x), SE3(FORWARD, np.array([x, 0.3, 0.7])))
    cloud = ground_map.cloud()
    assert np.allclose(cloud.points[:, 0], 2.007, atol=2e-3)
    assert cloud.points[:, 1].mean() == pytest.approx(0.3, abs=0.03)
    assert cloud.points[:, 2].mean() == pytest.approx(0.7, abs=0.03)
    assert np.allclose(cloud.normals, [-1, 0, 0], atol=0.05)
    assert (np.abs(cloud.colours.astype(int) - 90) <= 1).all()


def test_averaging_beats_the_noise_of_one_frame() -> None:
    ground_map = GroundMap(CAMERA, GroundMapping(min_keyframes=20))
    for seed in range(30):
        ground_map.add(wall_image(2.09, noise=0.02, seed=seed), SE3(FORWARD, np.zeros(3)))
    error = ground_map.cloud().points[:, 0] - 2.09
    assert np.abs(error).mean() < 0.02 / np.sqrt(30)


def test_far_missing_and_silhouette_depth_stay_out() -> None:
    depth = np.full((120, 160), 2.003, np.float32)
    depth[:, :40] = 9.0
    depth[:, 80:120] = 1.003
    depth[:, 120:] = np.nan
    ground_map = GroundMap(CAMERA, GroundMapping(min_keyframes=1, voxel_m=0.01))
    ground_map.add(GroundImage(0, np.zeros((120, 160, 3), np.uint8), depth), SE3.identity())
    points = ground_map.cloud().points
    columns = CAMERA.project(points)[:, 0]
    assert (np.minimum(np.abs(points[:, 2] - 1), np.abs(points[:, 2] - 2)) < 0.01).all()
    assert columns.min() > 38.5
    assert columns.max() < 121.5
    assert (points[columns > 81, 2] < 1.5).all()


def test_a_surface_needs_enough_keyframes() -> None:
    ground_map = GroundMap(CAMERA, GroundMapping(min_keyframes=3))
    assert len(ground_map.cloud()) == 0
    for added in range(3):
        assert (len(ground_map.cloud()) > 0) == (added >= 3)
        ground_map.add(wall_image(2.007), SE3(FORWARD, np.zeros(3)))
    assert len(ground_map.cloud()) > 0


def test_same_frames_same_bytes() -> None:
    clouds = []
    for _ in range(2):
        ground_map = GroundMap(CAMERA, GroundMapping(min_keyframes=1))
        for seed in range(3):
            ground_map.add(wall_image(1.5, 0.01, seed), SE3(FORWARD, np.array([0, seed / 10, 0])))
        clouds.append(ground_map.cloud())
    assert clouds[0].points.tobytes() == clouds[1].points.tobytes()
    assert clouds[0].colours.tobytes() == clouds[1].colours.tobytes()


def test_keyframes_follow_motion() -> None:
    ground_map = GroundMap(CAMERA, GroundMapping(keyframe_distance_m=0.1, keyframe_angle_deg=5))
    assert ground_map.wants(SE3.identity())
    ground_map.add(wall_image(2.007), SE3.identity())
    assert not ground_map.wants(SE3.from_heading(np.deg2rad(4.9), [0.09, 0, 0]))
    assert ground_map.wants(SE3.from_heading(0.0, [0.11, 0, 0]))
    assert ground_map.wants(SE3.from_heading(np.deg2rad(5.1)))


def test_coming_back_adds_no_keyframes_without_end() -> None:
    """Back and forth along a line: the first laps add keyframes, the others none."""
    bounds = GroundMapping(keyframe_distance_m=0.1, keyframe_angle_deg=5, keyframes_a_view=2)
    ground_map = GroundMap(CAMERA, bounds)
    image = wall_image(2.0)
    counts = []
    for _ in range(5):
        for x in [*np.arange(0, 1, 0.05), *np.arange(1, 0, -0.05)]:
            pose = SE3.from_heading(0.0, [x, 0, 0])
            if ground_map.wants(pose):
                ground_map.add(image, pose)
        counts.append(ground_map.keyframes)
    assert counts[0] >= 11
    assert counts[1] == counts[4]
    assert ground_map.wants(SE3.from_heading(np.deg2rad(8), [0.5, 0, 0]))  # another view


def path(offset: float = 0.0, turn_deg: float = 0.0) -> list[SE3]:
    """Three poses before a wall; those after the first are off by `offset` along y."""
    return [
        SE3.from_heading(np.deg2rad(turn_deg * (i > 0)))
        @ SE3(FORWARD, np.array([0.1 * i, offset * i, 0.7]))
        for i in range(3)
    ]


def built(poses: list[SE3]) -> GroundMap:
    ground_map = GroundMap(CAMERA, GroundMapping(min_keyframes=1))
    for i, pose in enumerate(poses):
        image = wall_image(2.0 - 0.1 * i, 0.004, seed=i)
        ground_map.add(GroundImage(i, image.colour, image.depth), pose)
    return ground_map


def assert_same_map(one: GroundMap, other: GroundMap) -> None:
    assert one.cloud().points.tobytes() == other.cloud().points.tobytes()
    assert one.cloud().colours.tobytes() == other.cloud().colours.tobytes()


@pytest.mark.parametrize("asked_before", [False, True])
def test_after_a_correction_the_map_is_that_of_the_corrected_poses(asked_before: bool) -> None:
    drifted, right = built(path(0.03, 1.0)), built(path())
    if asked_before:
        assert drifted.cloud().points.tobytes() != right.cloud().points.tobytes()
    assert drifted.follow(Trajectory.from_poses([0, 1, 2], path()))
    assert_same_map(drifted, right)


def test_a_keyframe_added_after_a_correction_joins_the_moved_ones() -> None:
    poses = path()
    drifted = built(path(0.03)[:2])
    drifted.follow(Trajectory.from_poses([0, 1], poses[:2]))
    image = wall_image(1.8, 0.004, seed=2)
    drifted.add(GroundImage(2, image.colour, image.depth), poses[2])
    assert_same_map(drifted, built(poses))


def test_small_corrections_are_left_until_they_add_up() -> None:
    ground_map, right = built(path()), path()
    limit = GroundMapping().follow_distance_m
    small, large = path(0.4 * limit), path(0.6 * limit)  # the last of three moves twice as far
    assert not ground_map.follow(Trajectory.from_poses([0, 1, 2], small))
    assert_same_map(ground_map, built(right))
    assert ground_map.follow(Trajectory.from_poses([0, 1, 2], large))
    assert_same_map(ground_map, built(large))


def test_keyframes_that_the_trajectory_lacks_stay() -> None:
    ground_map, moved = built(path()), path(0.03)
    assert ground_map.follow(Trajectory.from_poses([1, 7], [moved[1], moved[2]]))
    assert_same_map(ground_map, built([path()[0], moved[1], path()[2]]))


def test_a_kept_keyframe_is_small_and_true_to_its_image() -> None:
    rng = np.random.default_rng(1)
    camera_shape = (480, 640)
    depth = (2 + 0.3 * np.sin(np.arange(640) / 90) + rng.normal(0, 0.003, camera_shape)).astype(
        np.float32
    )
    depth[:40] = np.nan
    depth[-40:] = 5.5
    colour = np.repeat(rng.integers(60, 180, (30, 40, 3), np.uint8), 16, axis=0).repeat(16, axis=1)
    kept = GroundKeyframe.pack(GroundImage(5, colour, depth), SE3.identity(), 4.0)
    back = kept.depth()
    inside = back > 0
    assert np.abs(back - depth)[inside].max() <= 0.51e-4
    assert inside[42:-42].all()
    assert not inside[:40].any()
    assert not inside[-40:].any()
    assert np.abs(kept.colour().astype(int) - colour).mean() < 4
    assert len(kept.packed_depth) + len(kept.packed_colour) < 700_000


def test_a_keyframe_without_depth_adds_nothing() -> None:
    ground_map = GroundMap(CAMERA, GroundMapping(min_keyframes=1))
    ground_map.add(wall_image(np.nan), SE3.identity())
    assert len(ground_map.cloud()) == 0
    ground_map.add(wall_image(2.007), SE3.identity())
    assert ground_map.keyframes == 2
    assert len(ground_map.cloud()) > 100

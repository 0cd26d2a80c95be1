"""Corners are expected where they would be, by what is known about them."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from airground.core.se3 import SE3
from airground.slam.feature_tracker import FeatureTracker, expected_pixels
from airground.slam.sparse_map import SparseMap
from tests.slam.views import CAMERA, down_at, observe, seen_points

HERE = down_at([0.3, -0.2, 2.2], (0.05, 0.02, 0.4))


def scene(mapped: int, count: int = 60, z: tuple[float, float] = (1.5, 2.5)):
    """A map of which `mapped` points are in it, a tracker that sees all, and the truth."""
    points = seen_points(HERE, count, z, np.random.default_rng(0))
    sparse_map, tracker = SparseMap(), FeatureTracker(17, 1)
    pixels = observe(HERE, points)
    ids = sparse_map.new_points(pixels, 0)
    sparse_map.place(ids[:mapped], points[:mapped])
    tracker.add(ids, pixels)
    return sparse_map, tracker, points


@settings(deadline=None, max_examples=25)
@given(st.integers(0, 60), st.tuples(*[st.floats(-3, 3)] * 6))
def test_without_motion_corners_stay(mapped: int, twist: tuple[float, ...]) -> None:
    sparse_map, tracker, _ = scene(mapped)
    moved = SE3.exp(np.array(twist))  # whatever the pose is
    sparse_map.move(1.0, moved.rotation, np.zeros(3))
    here = SE3(moved.rotation, np.zeros(3)) @ HERE
    stays = expected_pixels(sparse_map, tracker, CAMERA, here, here)
    np.testing.assert_allclose(stays, tracker.pixels, atol=1e-3)


def test_map_points_go_by_their_place() -> None:
    sparse_map, tracker, points = scene(60)
    there = down_at([0.5, 0.1, 2.0], (0.1, -0.05, 0.6))
    expected = expected_pixels(sparse_map, tracker, CAMERA, HERE, there)
    np.testing.assert_allclose(expected, observe(there, points), atol=0.01)


def test_other_corners_go_as_if_at_the_depth_of_most() -> None:
    there = SE3(HERE.rotation, HERE.translation + HERE.rotation @ [0.1, 0.0, 0.0])
    sparse_map, tracker, points = scene(30)
    z = np.median((HERE.inverse() @ points[:30])[:, 2])
    expected = expected_pixels(sparse_map, tracker, CAMERA, HERE, there)
    shift = expected[30:] - tracker.pixels[30:]
    np.testing.assert_allclose(shift, np.tile([-0.1 * CAMERA.fx / z, 0.0], (30, 1)), atol=0.01)


def test_without_any_depth_only_the_turn_counts() -> None:
    sparse_map, tracker, points = scene(0)
    turn = HERE.rotation @ SE3.from_rotation_vector((0.05, -0.1, 0.2)).rotation
    there = SE3(turn, HERE.translation + np.array([5.0, 5.0, 0.0]))
    expected = expected_pixels(sparse_map, tracker, CAMERA, HERE, there)
    np.testing.assert_allclose(expected, observe(SE3(turn, HERE.translation), points), atol=0.01)


@pytest.mark.parametrize("count", [0, 5])
def test_what_would_be_behind_the_camera_is_expected_where_it_was(count: int) -> None:
    sparse_map, tracker, _ = scene(count, count)
    behind = SE3(HERE.rotation, HERE.translation + HERE.rotation @ [0.0, 0.0, 10.0])
    expected = expected_pixels(sparse_map, tracker, CAMERA, HERE, behind)
    np.testing.assert_array_equal(expected, tracker.pixels)

"""Rows taken one after the other, straightened by the camera's turn."""

from __future__ import annotations

import numpy as np
import pytest

from airground.core.se3 import SE3
from airground.slam.depth_lookup import inverse_depths_at
from airground.slam.rolling_shutter import GLOBAL, Shutter, shutter_of
from tests.slam.views import CAMERA

READOUT_S, SECONDS = 0.026, 1 / 30
RATE = np.array([1.5, -2.0, 1.2])


def turned(points: np.ndarray, seconds: float) -> np.ndarray:
    """(N, 3) points in a camera that turned for so long."""
    return SE3.from_rotation_vector(RATE * seconds).inverse() @ points


def seen(points: np.ndarray, stamp_s: float = 0.0) -> np.ndarray:
    """(N, 2) pixels of points, each at the moment at which its row is read."""
    rows = CAMERA.project(turned(points, stamp_s))[:, 1]
    for _ in range(30):
        times = stamp_s + (rows - (CAMERA.height - 1) / 2) / CAMERA.height * READOUT_S
        each = [turned(point[None], t) for point, t in zip(points, times, strict=True)]
        pixels = CAMERA.project(np.concatenate(each))
        rows = pixels[:, 1]
    return pixels


def some_points() -> np.ndarray:
    rng = np.random.default_rng(0)
    xy = rng.uniform(40, [CAMERA.width - 40, CAMERA.height - 40], (200, 2))
    rays = np.column_stack([xy, np.ones(200)]) @ np.linalg.inv(CAMERA.matrix()).T
    return rays * rng.uniform(1, 4, (200, 1))


def true_shutter() -> Shutter:
    return Shutter(CAMERA, RATE * READOUT_S / CAMERA.height)


def test_rows_are_straightened_to_where_the_middle_one_sees_the_points() -> None:
    points = some_points()
    pixels, straight = seen(points), CAMERA.project(points)
    assert np.abs(pixels - straight).max() > 5.0
    np.testing.assert_allclose(true_shutter().straight(pixels), straight, atol=1e-6)


def test_straight_pixels_are_found_in_the_image_again() -> None:
    shutter, pixels = true_shutter(), seen(some_points())
    np.testing.assert_allclose(shutter.in_image(shutter.straight(pixels)), pixels, atol=0.02)


def test_corners_show_the_turn_even_if_some_are_wrong() -> None:
    points = some_points()
    before, here = seen(points, -SECONDS), seen(points)
    here[:30] += np.random.default_rng(1).uniform(-40, 40, (30, 2))
    shutter = shutter_of(CAMERA, READOUT_S, before, here, SECONDS)
    rate = shutter.turn_per_row * CAMERA.height / READOUT_S
    np.testing.assert_allclose(rate, RATE, atol=0.05)


def test_depth_is_along_the_axis_of_the_middle_row() -> None:
    wall_m = 2.0
    depth = np.full((CAMERA.height, CAMERA.width), wall_m, np.float32)
    corners = np.array([[30.0, 30.0], [CAMERA.width - 30.0, CAMERA.height - 30.0]])
    shutter = true_shutter()
    inverse = shutter.inverse_depths_at(depth, corners, 5.0)
    rays = np.column_stack([corners, np.ones(2)]) @ np.linalg.inv(CAMERA.matrix()).T
    times = (corners[:, 1] - (CAMERA.height - 1) / 2) * READOUT_S / CAMERA.height
    in_middle = [turned(wall_m * ray[None], -t)[0] for ray, t in zip(rays, times, strict=True)]
    np.testing.assert_allclose(1.0 / inverse, [point[2] for point in in_middle], rtol=1e-6)
    assert abs(1.0 / inverse[0] - wall_m) > 0.005


def test_a_global_shutter_leaves_everything_as_it_is() -> None:
    pixels = seen(some_points())
    assert shutter_of(CAMERA, 0.0, pixels, pixels, SECONDS) is GLOBAL
    assert GLOBAL.straight(pixels) is pixels
    assert GLOBAL.in_image(pixels) is pixels
    depth = np.full((CAMERA.height, CAMERA.width), 2.0, np.float32)
    plain = inverse_depths_at(depth, pixels, 5.0)
    np.testing.assert_array_equal(GLOBAL.inverse_depths_at(depth, pixels, 5.0), plain)


@pytest.mark.parametrize("count", [0, 1, 14])
def test_few_corners_show_no_turn(count: int) -> None:
    few = np.zeros((count, 2), np.float32)
    assert shutter_of(CAMERA, READOUT_S, few, few, SECONDS) is GLOBAL
    assert true_shutter().straight(few).shape == (count, 2)

"""Rows taken one after the other, straightened by the camera's turn."""

from __future__ import annotations

import numpy as np
import pytest

from airground.core.se3 import SE3
from airground.slam.rolling_shutter import GLOBAL, Shutter
from tests.slam.views import CAMERA

READOUT_S, SECONDS = 0.026, 1 / 30
RATE = np.array([1.5, -2.0, 1.2])


def rate_turn() -> np.ndarray:
    return SE3.from_rotation_vector(RATE * SECONDS).rotation


def seen(points: np.ndarray) -> np.ndarray:
    """(N, 2) pixels of points, each at the moment at which its row was read."""
    rows = CAMERA.project(points)[:, 1]
    for _ in range(30):
        times = (rows - (CAMERA.height - 1) / 2) / CAMERA.height * READOUT_S
        turned = [
            SE3.from_rotation_vector(RATE * t).inverse() @ p[None]
            for t, p in zip(times, points, strict=True)
        ]
        pixels = CAMERA.project(np.concatenate(turned))
        rows = pixels[:, 1]
    return pixels


def points() -> np.ndarray:
    rng = np.random.default_rng(0)
    xy = rng.uniform(20, [CAMERA.width - 20, CAMERA.height - 20], (200, 2))
    rays = np.column_stack([xy, np.ones(200)]) @ np.linalg.inv(CAMERA.matrix()).T
    return rays * rng.uniform(1, 4, (200, 1))


def test_rows_are_straightened_to_where_the_middle_one_sees_the_points() -> None:
    shutter = Shutter.turning(CAMERA, READOUT_S, rate_turn(), SECONDS)
    pixels, straight = seen(points()), CAMERA.project(points())
    assert np.abs(pixels - straight).max() > 5.0
    np.testing.assert_allclose(shutter.straight(pixels), straight, atol=1e-6)


def test_straight_pixels_are_found_in_the_image_again() -> None:
    shutter = Shutter.turning(CAMERA, READOUT_S, rate_turn(), SECONDS)
    pixels = seen(points())
    np.testing.assert_allclose(shutter.in_image(shutter.straight(pixels)), pixels, atol=0.02)


def test_a_global_shutter_leaves_pixels_as_they_are() -> None:
    assert Shutter.turning(CAMERA, 0.0, rate_turn(), SECONDS) is GLOBAL
    pixels = seen(points())
    assert GLOBAL.straight(pixels) is pixels
    assert GLOBAL.in_image(pixels) is pixels


@pytest.mark.parametrize("count", [0, 1])
def test_few_pixels(count: int) -> None:
    shutter = Shutter.turning(CAMERA, READOUT_S, rate_turn(), SECONDS)
    assert shutter.straight(np.zeros((count, 2), np.float32)).shape == (count, 2)

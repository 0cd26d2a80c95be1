"""The camera's position from matches when its rotation is known."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import least_squares

from airground.core.se3 import SE3
from airground.slam.geometry.translation_ransac import translation_by_known_rotation
from tests.slam.views import CAMERA, down_at, observe, seen_points

TRUTH = down_at([0.4, -0.3, 2.2], [0.05, -0.08, 0.7])


@pytest.mark.parametrize("share", [0.0, 0.3, 0.5])
def test_finds_the_position_among_outliers(share: float) -> None:
    rng = np.random.default_rng(0)
    points = seen_points(TRUTH, 150, (1.2, 2.6), rng)
    pixels = observe(TRUTH, points) + 0.5 * rng.standard_normal((150, 2))
    wrong = np.arange(150) < 150 * share
    pixels[wrong] = rng.uniform((0, 0), (752, 480), (wrong.sum(), 2))
    pose, inliers = translation_by_known_rotation(
        points, pixels, CAMERA, TRUTH.rotation, 3.0, 50, rng
    )
    assert pose is not None
    assert np.linalg.norm(pose.translation - TRUTH.translation) < 0.003
    assert inliers[~wrong].all()
    assert inliers[wrong].sum() <= 2


@pytest.mark.kernel
def test_ends_where_a_general_solver_does() -> None:
    """The slow twin: least reprojection errors over the position."""
    rng = np.random.default_rng(1)
    points = seen_points(TRUTH, 10, (1.2, 2.6), rng)
    pixels = observe(TRUTH, points) + 0.3 * rng.standard_normal((10, 2))
    pose, inliers = translation_by_known_rotation(
        points, pixels, CAMERA, TRUTH.rotation, 5.0, 20, rng
    )
    slow = least_squares(
        lambda p: (observe(SE3(TRUTH.rotation, p), points) - pixels).ravel(), TRUTH.translation
    )
    assert pose is not None
    assert inliers.all()
    # Weighted linear equations and reprojection errors differ in the second order of the noise.
    assert np.linalg.norm(pose.translation - slow.x) < 1e-4


def test_same_seed_same_answer() -> None:
    rng = np.random.default_rng(2)
    points = seen_points(TRUTH, 80, (1.2, 2.6), rng)
    pixels = observe(TRUTH, points) + rng.standard_normal((80, 2))
    first, second = (
        translation_by_known_rotation(
            points, pixels, CAMERA, TRUTH.rotation, 3.0, 30, np.random.default_rng(5)
        )
        for _ in range(2)
    )
    assert first[0] is not None
    assert second[0] is not None
    assert np.array_equal(first[0].translation, second[0].translation)
    assert np.array_equal(first[1], second[1])


def test_points_behind_the_camera_are_no_inliers() -> None:
    rng = np.random.default_rng(3)
    points = seen_points(TRUTH, 40, (1.2, 2.6), rng)
    pixels = observe(TRUTH, points)
    points[:10] = 2 * TRUTH.translation - points[:10]
    pose, inliers = translation_by_known_rotation(
        points, pixels, CAMERA, TRUTH.rotation, 3.0, 50, rng
    )
    assert pose is not None
    assert np.array_equal(inliers, np.arange(40) >= 10)


@pytest.mark.parametrize("n", [0, 1, 2])
def test_refuses_what_proves_nothing(n: int) -> None:
    rng = np.random.default_rng(4)
    points = seen_points(TRUTH, n, (1.2, 2.6), rng)
    pose, inliers = translation_by_known_rotation(
        points, observe(TRUTH, points), CAMERA, TRUTH.rotation, 3.0, 50, rng
    )
    assert pose is None
    assert inliers.shape == (n,)


def test_refuses_one_point_seen_many_times() -> None:
    rng = np.random.default_rng(5)
    points = np.repeat(seen_points(TRUTH, 1, (1.2, 2.6), rng), 20, axis=0)
    pose, inliers = translation_by_known_rotation(
        points, observe(TRUTH, points), CAMERA, TRUTH.rotation, 3.0, 50, rng
    )
    assert pose is None
    assert not inliers.any()

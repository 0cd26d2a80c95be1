"""Points from two views."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import least_squares

from airground.core.se3 import SE3
from airground.slam.geometry.triangulation import triangulate_pairs
from tests.slam.views import CAMERA, down_at, observe, seen_points

A = down_at([0.0, 0.0, 2.0])
SHIFT = np.array([[10.0, 0.0], [0.0, 0.0]])
B = down_at([0.25, -0.1, 2.1], [0.03, 0.05, 0.2])


def test_exact_pixels_give_the_points_back() -> None:
    rng = np.random.default_rng(0)
    points = seen_points(A, 100, (1.0, 3.0), rng)
    found = triangulate_pairs(A, observe(A, points), B, observe(B, points), CAMERA)
    assert found.good.all()
    np.testing.assert_allclose(found.points, points, atol=1e-9)
    np.testing.assert_allclose(found.depth_a, (A.inverse() @ points)[:, 2], atol=1e-9)
    rays_a, rays_b = points - A.translation, points - B.translation
    cosine = (rays_a * rays_b).sum(1) / np.linalg.norm(rays_a, axis=1)
    expected = np.arccos(cosine / np.linalg.norm(rays_b, axis=1))
    np.testing.assert_allclose(found.parallax_rad, expected, atol=1e-7)


@pytest.mark.kernel
def test_ends_where_a_general_solver_does() -> None:
    """The slow twin: the point of least reprojection errors, by scipy."""
    rng = np.random.default_rng(1)
    points = seen_points(A, 15, (1.0, 3.0), rng)
    pixels_a = observe(A, points) + rng.standard_normal((15, 2))
    pixels_b = observe(B, points) + rng.standard_normal((15, 2))
    found = triangulate_pairs(A, pixels_a, B, pixels_b, CAMERA)
    for i in range(15):

        def errors(x: np.ndarray, i: int = i) -> np.ndarray:
            off_a = observe(A, x[None])[0] - pixels_a[i]
            return np.concatenate([off_a, observe(B, x[None])[0] - pixels_b[i]])

        slow = least_squares(errors, points[i], xtol=1e-14, ftol=1e-14)
        assert np.linalg.norm(found.points[i] - slow.x) < 1e-5
        largest = np.linalg.norm(slow.fun.reshape(2, 2), axis=1).max()
        assert found.reprojection_px[i] == pytest.approx(largest, abs=1e-3)


def test_sigma_is_the_scatter_of_the_inverse_depth() -> None:
    rng = np.random.default_rng(2)
    point = np.repeat(seen_points(A, 1, (2.0, 2.1), rng), 4000, axis=0)
    pixels_a = observe(A, point) + rng.standard_normal((4000, 2))
    pixels_b = observe(B, point) + rng.standard_normal((4000, 2))
    found = triangulate_pairs(A, pixels_a, B, pixels_b, CAMERA)
    assert np.std(1 / found.depth_a) == pytest.approx(found.inverse_depth_sigma.mean(), rel=0.05)


def test_every_point_can_have_its_own_pose() -> None:
    rng = np.random.default_rng(3)
    points = seen_points(A, 30, (1.0, 3.0), rng)
    shifts = rng.uniform(-0.2, 0.2, (30, 3))
    firsts = [down_at(A.translation + s, s) for s in shifts]
    pixels_a = np.concatenate([observe(T, p[None]) for T, p in zip(firsts, points, strict=True)])
    poses = np.array([T.rotation for T in firsts]), np.array([T.translation for T in firsts])
    found = triangulate_pairs(poses, pixels_a, B, observe(B, points), CAMERA)
    np.testing.assert_allclose(found.points[found.good], points[found.good], atol=1e-8)
    assert found.good.mean() > 0.9


def test_points_behind_or_at_infinity_are_not_good() -> None:
    pixels = np.array([[300.0, 200.0], [300.0, 200.0]])
    beside = SE3(A.rotation, A.translation + A.rotation[:, 0] * 0.2)
    # Moving to its right shifts a point to the left; the other way it would lie behind.
    found = triangulate_pairs(A, pixels, beside, pixels + SHIFT, CAMERA)
    assert not found.good.any()
    assert np.isnan(found.points).all()
    still = triangulate_pairs(A, pixels, A, pixels, CAMERA)
    assert not still.good.any()
    assert (still.parallax_rad < 1e-9).all()


def test_wrong_matches_show_in_the_reprojection_error() -> None:
    rng = np.random.default_rng(4)
    points = seen_points(A, 50, (1.5, 2.5), rng)
    pixels_b = observe(B, points)
    across = np.array([[0.0, -1.0], [1.0, 0.0]]) @ (pixels_b[0] - observe(B, points + 0.01)[0])
    pixels_b = pixels_b + 20 * across / np.linalg.norm(across)
    found = triangulate_pairs(A, observe(A, points), B, pixels_b, CAMERA)
    assert np.median(found.reprojection_px) > 1.0


def test_nothing_gives_nothing() -> None:
    empty = np.zeros((0, 2))
    assert len(triangulate_pairs(A, empty, B, empty, CAMERA).good) == 0

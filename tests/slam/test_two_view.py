"""The first two views of a map, over planes and boxes, moving sideways and up."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
from scipy.optimize import minimize

from airground.core.se3 import SE3
from airground.slam.geometry import epipolar
from airground.slam.geometry.two_view import TwoViewStart, start_from_two_views
from tests.slam.views import CAMERA, angle_between, down_at, observe

SIDEWAYS, UP, OBLIQUE, HOVER = (0.3, 0.05, 0.02), (0.01, 0.02, 0.25), (0.2, 0.0, 0.2), (0, 0, 0)
ROTATION_SIGMA = 0.005


@dataclass(frozen=True)
class Pair:
    """Two noisy views of one scene."""

    T_a_b: SE3
    points_a: np.ndarray
    pixels_a: np.ndarray
    pixels_b: np.ndarray
    wrong: np.ndarray

    def start(self, rng: np.random.Generator, *, known: bool) -> TwoViewStart:
        """With the gyro's error, or without a gyro."""
        if not known:
            return start_from_two_views(self.pixels_a, self.pixels_b, CAMERA, rng)
        turn = SE3.from_rotation_vector(rng.normal(0, ROTATION_SIGMA, 3)).rotation
        return start_from_two_views(
            self.pixels_a,
            self.pixels_b,
            CAMERA,
            rng,
            R_a_b=turn @ self.T_a_b.rotation,
            rotation_sigma=ROTATION_SIGMA,
        )


def floor(kind: str, height: float, rng: np.random.Generator) -> np.ndarray:
    """(N, 3) points on a floor that fills the image from a height, z = 0 at its lowest."""
    n = 400
    z = {
        "plane": np.zeros(n),
        "bumps": 0.1 * height * rng.random(n),
        "boxes": np.where(rng.random(n) < 0.4, height * rng.uniform(0.1, 0.3, n), 0.0),
    }
    return np.column_stack([rng.uniform(-height, height, (n, 2)), z[kind]])


def view_twice(kind: str, motion: tuple, rng: np.random.Generator) -> Pair:
    """Heights of 1.2 m in take-off and 2.2 m else; 0.5 px of noise, 30 % wrong matches."""
    height = 1.2 if motion == UP else 2.2
    T_map_a = down_at([0, 0, height], rng.normal(0, 0.05, 3))
    heading = SE3.from_heading(rng.uniform(0, 2 * np.pi)).rotation
    turn = SE3.from_rotation_vector(rng.normal(0, 0.08, 3)).rotation
    T_map_b = SE3(turn @ T_map_a.rotation, T_map_a.translation + heading @ np.array(motion))
    points = floor(kind, height, rng)
    pixels = np.stack([observe(T, points) for T in (T_map_a, T_map_b)])
    inside = ((pixels > 0) & (pixels < (751, 479))).all(axis=(0, 2))
    pixels = pixels[:, inside] + 0.5 * rng.standard_normal((2, inside.sum(), 2))
    wrong = rng.random(inside.sum()) < 0.3
    pixels[1, wrong] = rng.uniform((0, 0), (752, 480), (wrong.sum(), 2))
    points_a = T_map_a.inverse() @ points[inside]
    return Pair(T_map_a.inverse() @ T_map_b, points_a, *pixels, wrong)


def check(start: TwoViewStart, pair: Pair, direction_deg: float) -> None:
    """Direction, rotation, points and inliers of a start against the truth."""
    assert start.good, start.reason
    assert start.T_a_b is not None
    t, found = pair.T_a_b.translation, start.T_a_b.translation
    cosine = t @ found / np.linalg.norm(t) / np.linalg.norm(found)
    assert np.rad2deg(np.arccos(cosine)) < direction_deg
    assert angle_between(pair.T_a_b.rotation, start.T_a_b.rotation) < np.deg2rad(1.2)
    assert start.inliers[~pair.wrong].mean() > 0.85
    assert start.inliers[pair.wrong].mean() < 0.1
    depths = pair.points_a[start.inliers, 2] / np.median(pair.points_a[start.inliers, 2])
    assert np.median(start.points_a[start.inliers, 2]) == pytest.approx(1.0)
    assert np.median(np.abs(start.points_a[start.inliers, 2] - depths)) < 0.05


@pytest.mark.parametrize("motion", [SIDEWAYS, UP, OBLIQUE], ids=["sideways", "up", "oblique"])
@pytest.mark.parametrize("kind", ["plane", "bumps", "boxes"])
def test_known_rotation_starts_over_anything(kind: str, motion: tuple) -> None:
    rng = np.random.default_rng(0)
    for _ in range(4):
        pair = view_twice(kind, motion, rng)
        check(pair.start(rng, known=True), pair, 8.0)


@pytest.mark.parametrize("kind", ["plane", "bumps", "boxes"])
def test_unknown_rotation_starts_sideways_or_not_at_all(kind: str) -> None:
    rng = np.random.default_rng(1)
    good = 0
    for _ in range(4):
        pair = view_twice(kind, SIDEWAYS, rng)
        start = pair.start(rng, known=False)
        if start.good:
            check(start, pair, 8.0)
            good += 1
    assert good >= 3


def test_without_a_gyro_two_answers_over_a_plane_are_refused() -> None:
    rng = np.random.default_rng(2)
    for _ in range(4):
        start = view_twice("plane", OBLIQUE, rng).start(rng, known=False)
        assert not start.good
        assert "two relative poses" in start.reason


@pytest.mark.parametrize("known", [True, False])
@pytest.mark.parametrize("kind", ["plane", "boxes"])
def test_hovering_and_turning_are_refused(kind: str, known: bool) -> None:
    rng = np.random.default_rng(3)
    for _ in range(4):
        start = view_twice(kind, HOVER, rng).start(rng, known=known)
        assert not start.good
        assert "parallax" in start.reason
        assert start.T_a_b is None
        assert np.isnan(start.points_a).all()


def test_few_matches_and_matches_of_nothing_are_refused() -> None:
    rng = np.random.default_rng(4)
    pair = view_twice("boxes", SIDEWAYS, rng)
    few = start_from_two_views(pair.pixels_a[:20], pair.pixels_b[:20], CAMERA, rng)
    assert few.reason == "20 matches, at least 30 are needed"
    noise = rng.uniform((0, 0), (752, 480), (2, 200, 2))
    for rotation in (None, np.eye(3)):
        assert not start_from_two_views(*noise, CAMERA, rng, R_a_b=rotation).good


@pytest.mark.parametrize("known", [True, False])
def test_same_seed_same_answer(known: bool) -> None:
    pair = view_twice("boxes", SIDEWAYS, np.random.default_rng(5))
    first, second = (pair.start(np.random.default_rng(6), known=known) for _ in range(2))
    assert np.array_equal(first.points_a, second.points_a, equal_nan=True)


@pytest.mark.kernel
def test_sampson_is_the_distance_to_rays_that_meet() -> None:
    """The slow twin: with tiny noise, the optimal correction's length."""
    rng = np.random.default_rng(7)
    T_a_b = SE3.from_rotation_vector([0.1, -0.05, 0.2], [0.4, 0.1, 0.05])
    E = epipolar.essential(T_a_b.rotation, T_a_b.translation)
    for point_b in rng.uniform((-1, -1, 2), (1, 1, 4), (5, 3)):
        point_a = T_a_b @ point_b
        exact = np.concatenate([point_a[:2] / point_a[2], point_b[:2] / point_b[2]])
        noisy = exact + 1e-4 * rng.standard_normal(4)

        def meet(x: np.ndarray) -> float:
            return 1e3 * np.append(x[:2], 1) @ E @ np.append(x[2:], 1)

        nearest = minimize(
            lambda x, noisy=noisy: 1e6 * ((x - noisy) ** 2).sum(),
            noisy,
            constraints={"type": "eq", "fun": meet},
            options={"ftol": 1e-15},
        )
        expected = np.linalg.norm(nearest.x - noisy)
        assert abs(epipolar.sampson(E, *noisy)) == pytest.approx(expected, rel=1e-2, abs=1e-8)


@pytest.mark.kernel
def test_refining_exact_rays_ends_at_the_truth() -> None:
    rng = np.random.default_rng(8)
    T_a_b = SE3.from_rotation_vector([0.1, -0.05, 0.2], [0.4, 0.1, 0.05])
    points_b = rng.uniform((-1, -1, 1), (1, 1, 3), (25, 3))
    points_a = T_a_b @ points_b
    R0 = SE3.from_rotation_vector([0.004, -0.003, 0.005]).rotation @ T_a_b.rotation
    R, t, inliers, covariance = epipolar.refine(
        points_a[:, :2] / points_a[:, 2:],
        points_b[:, :2] / points_b[:, 2:],
        R0,
        T_a_b.translation + 0.01,
        0.02,
        0.001,
        np.inf,
    )
    assert inliers.all()
    assert angle_between(R, T_a_b.rotation) < 1e-6
    np.testing.assert_allclose(t, T_a_b.translation / np.linalg.norm(T_a_b.translation), atol=1e-6)
    assert (np.diag(covariance) > 0).all()

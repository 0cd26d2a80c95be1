"""Errors of poses and of scale move the place where maps fit, by as much as the covariance says."""

from __future__ import annotations

import numpy as np
import pytest

from airground.config import Config
from airground.core.se3 import SE3
from airground.localization.height_map_pair import HeightMapPair
from airground.localization.particle_filter import MonteCarloLocalizer
from airground.localization.pose_errors import PoseErrors

HEIGHT_M, TILT, HEADING = 2.0, np.deg2rad(0.3), 0.7
NOTHING, ROBOT = np.zeros((3, 3)), np.array([0.4, -0.3, 0.5])
AT = np.array([1.9, 1.7, HEADING])
"""The MAV's camera, 2.5 m from the ground robot."""


def tilted(sigma: float = TILT) -> np.ndarray:
    return np.diag([sigma, sigma, 0.0]) ** 2


def turned_by(lever: np.ndarray, mav: np.ndarray, ground: np.ndarray) -> PoseErrors:
    """Rotations alone are uncertain."""
    return PoseErrors(lever, mav, ground, ROBOT, 0.0)


def test_a_tilt_moves_the_camera_by_its_height() -> None:
    over = np.array([0.0, 0.0, HEIGHT_M])
    expected = (HEIGHT_M * TILT) ** 2 * np.eye(2)
    for one in (turned_by(over, tilted(), NOTHING), turned_by(over, NOTHING, tilted())):
        np.testing.assert_allclose(one.covariance(AT), expected, atol=1e-12)
    both = turned_by(over, tilted(), tilted()).covariance(AT)
    np.testing.assert_allclose(both, 2.0 * expected, atol=1e-12)


def test_a_heading_moves_what_is_not_over_the_middle() -> None:
    beside = np.array([0.5, 0.0, HEIGHT_M])
    turned = np.diag([0, 0, TILT]) ** 2
    expected = np.diag([0.0, (0.5 * TILT) ** 2])
    errors = turned_by(beside, turned, NOTHING)
    np.testing.assert_allclose(errors.covariance(np.zeros(3)), expected)
    expected = np.diag([(0.5 * TILT) ** 2, 0.0])
    quarter = errors.covariance(np.array([0.0, 0.0, np.pi / 2]))
    np.testing.assert_allclose(quarter, expected, atol=1e-12)


def test_a_scale_moves_a_place_along_the_line_from_the_ground_robot() -> None:
    errors = PoseErrors(np.zeros(3), NOTHING, NOTHING, ROBOT, 0.02)
    along, across = np.array([1.5, 2.0]), np.array([-2.0, 1.5])
    covariance = errors.covariance(AT)
    np.testing.assert_allclose(covariance @ along, (0.02 * 2.5) ** 2 * along)
    np.testing.assert_allclose(covariance @ across, 0.0, atol=1e-15)
    assert not errors.covariance(ROBOT).any()  # where the robot is, no scale moves anything


def test_poses_without_an_error_add_nothing() -> None:
    assert not PoseErrors.none().covariance(AT).any()


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_the_covariance_is_that_of_drawn_errors(seed: int) -> None:
    """The slow twin: the surface's middle stays, the camera is where turned maps put it, and a map
    of another scale puts that elsewhere from the ground robot."""
    rng = np.random.default_rng(seed)
    roots = rng.normal(0, 0.004, (2, 3, 3))
    turns_mav, turns_ground = (root @ root.T for root in roots)
    lever = rng.normal(0, 1.0, 3)
    scale_sigma = rng.uniform(0.001, 0.01)
    errors = PoseErrors(lever, turns_mav, turns_ground, ROBOT, scale_sigma)
    turn = SE3.from_heading(HEADING)
    camera = turn @ lever
    drawn = np.empty((20_000, 2))
    for row in drawn:
        of_mav, of_ground = (SE3.from_rotation_vector(root @ rng.normal(size=3)) for root in roots)
        row[:] = (of_ground @ (turn @ of_mav @ lever) - camera)[:2]
        row[:] += scale_sigma * rng.normal() * (AT - ROBOT)[:2]
    np.testing.assert_allclose(
        np.cov(drawn.T), errors.covariance(AT), rtol=0.05, atol=0.02 * np.var(drawn)
    )


def test_a_belief_contains_them() -> None:
    """Beyond what its particles show, and without another claim or place."""
    rng = np.random.default_rng(3)
    points = rng.uniform(-1, 1, (20_000, 3)).astype(np.float32)
    points[:, 2] = 0.3 * (np.hypot(points[:, 0], points[:, 1] - 0.2) < 0.5)
    beliefs = []
    for errors in (
        PoseErrors.none(),
        turned_by(np.array([0, 0, HEIGHT_M]), tilted(), tilted()),
    ):
        pair = HeightMapPair(
            1, points, np.zeros(3), points, np.zeros(2), 0.0, Config(), pose_errors=errors
        )
        filter_ = MonteCarloLocalizer(Config(), np.random.default_rng(4))
        for _ in filter_.update(pair):
            pass
        assert filter_.belief is not None
        beliefs.append(filter_.belief)
    without, with_errors = beliefs
    added = with_errors.covariance - without.covariance
    np.testing.assert_allclose(added, 2 * (HEIGHT_M * TILT) ** 2 * np.eye(2), atol=1e-12)
    np.testing.assert_array_equal(with_errors.particles, without.particles)
    assert with_errors.spread_m == without.spread_m
    assert with_errors.converged == without.converged

"""Headings from magnetometers."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from airground.core.se3 import SE3
from airground.localization.heading import HeadingEstimator

NORTH_AND_DOWN = np.array([2.1e-5, 0.0, -4.2e-5])


def field_of(north, rotation, rng, n=10, noise=5e-7):
    """Samples of a field whose horizontal part points to `north` in the map."""
    field_map = SE3.from_heading(north).rotation @ NORTH_AND_DOWN
    return field_map @ rotation + rng.normal(0, noise, (n, 3))


def fed(north, rng, disturbed=0.0, images=100):
    estimator = HeadingEstimator()
    for image in range(images):
        pose = SE3.from_rotation_vector((0.3, -0.2, 0.05 * image), (0.2 * image, 0.0, 0.0))
        bent = north + 0.8 if image < disturbed * images else north
        estimator.add(field_of(bent, pose.rotation, rng), pose)
    return estimator


@settings(max_examples=20, deadline=None)
@given(st.floats(-np.pi, np.pi))
def test_finds_north_whatever_the_attitude(north):
    estimator = fed(north, np.random.default_rng(0))
    assert abs(np.angle(np.exp(1j * (estimator.heading() - north)))) < np.deg2rad(0.2)
    assert estimator.spread() < np.deg2rad(3)


def test_a_disturbance_on_a_third_of_the_way_bends_it_little():
    estimator = fed(1.0, np.random.default_rng(1), disturbed=0.33)
    assert estimator.heading() == pytest.approx(1.0, abs=np.deg2rad(3))


def test_minutes_beside_iron_do_not_outvote_the_way_that_follows():
    rng = np.random.default_rng(4)
    estimator, rest = HeadingEstimator(), SE3.identity()
    for _ in range(600):
        estimator.add(field_of(0.1, rest.rotation, rng), rest)
    assert estimator.heading() == pytest.approx(0.1, abs=np.deg2rad(0.2))
    for image in range(60):
        pose = SE3.from_heading(0.0, (0.15 * image, 0.0, 0.0))
        estimator.add(field_of(0.0, pose.rotation, rng), pose)
    assert estimator.heading() == pytest.approx(0.0, abs=np.deg2rad(0.5))


def test_turning_in_place_is_as_good_as_moving():
    """Iron on the robot turns with it: only other attitudes tell it from north."""
    rng = np.random.default_rng(5)
    iron = np.array([2e-6, 1e-6, 0.0])
    estimator = HeadingEstimator()
    for turn in [0.0] * 500 + list(np.linspace(0, 2 * np.pi, 120)):
        pose = SE3.from_heading(turn)
        estimator.add(field_of(1.0, pose.rotation, rng) + iron, pose)
    assert estimator.heading() == pytest.approx(1.0, abs=np.deg2rad(0.5))


def test_the_difference_of_two_robots_is_the_turn_between_their_maps():
    rng = np.random.default_rng(2)
    turn = 2.5
    mav, ground = fed(0.4, rng), fed(0.4 + turn, rng)
    difference = np.angle(np.exp(1j * (ground.heading() - mav.heading())))
    assert difference == pytest.approx(turn, abs=np.deg2rad(0.3))


def test_too_little_or_directionless_says_nothing():
    rng = np.random.default_rng(3)
    estimator = HeadingEstimator()
    assert estimator.heading() is None
    assert estimator.spread() == np.inf
    estimator.add(np.full((100, 3), np.nan), SE3.identity())
    assert estimator.heading() is None
    estimator.add(field_of(0.0, np.eye(3), rng, n=10), SE3.identity())
    assert estimator.heading() is None

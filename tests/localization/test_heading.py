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
        rotation = SE3.from_rotation_vector((0.3, -0.2, 0.05 * image)).rotation
        bent = north + 0.8 if image < disturbed * images else north
        estimator.add(field_of(bent, rotation, rng), rotation)
    return estimator


@settings(max_examples=20, deadline=None)
@given(st.floats(-np.pi, np.pi))
def test_finds_north_whatever_the_attitude(north):
    estimator = fed(north, np.random.default_rng(0))
    assert abs(np.angle(np.exp(1j * (estimator.heading() - north)))) < np.deg2rad(0.2)
    assert estimator.spread() < np.deg2rad(3)


def test_a_disturbance_for_a_third_of_the_time_bends_it_little():
    estimator = fed(1.0, np.random.default_rng(1), disturbed=0.33)
    assert estimator.heading() == pytest.approx(1.0, abs=np.deg2rad(3))


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
    estimator.add(np.full((100, 3), np.nan), np.eye(3))
    assert estimator.heading() is None
    estimator.add(field_of(0.0, np.eye(3), rng, n=10), np.eye(3))
    assert estimator.heading() is None

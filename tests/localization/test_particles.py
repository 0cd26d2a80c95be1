"""The particle set's arithmetic."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from airground.localization.particles import (
    densest_mode,
    draw_cells,
    likelihoods,
    mean_pose,
    resample,
    weights,
)


def test_weights_follow_eq_5():
    costs = np.array([0.1, 0.3, 0.2])
    expected = np.exp(-costs / 0.05)
    np.testing.assert_allclose(weights(costs, 0.05), expected / expected.sum(), rtol=1e-12)


def test_what_overlaps_too_little_weighs_the_median():
    weight = weights(np.array([0.0, 0.1, np.nan, 0.3]), 0.1)
    assert weight[2] == pytest.approx(weight[1])
    assert weight.sum() == pytest.approx(1.0)


def test_a_wholly_infeasible_map_leaves_the_belief_alone():
    weight = weights(np.full(7, np.nan), 0.1)
    np.testing.assert_allclose(weight, 1 / 7)
    np.testing.assert_array_equal(resample(weight, np.random.default_rng(0)), np.arange(7))


def test_huge_costs_do_not_underflow():
    assert likelihoods(np.array([1e6, 1e6 + 1]), 1.0)[0] == 1.0


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(2, 60))
def test_systematic_resampling_draws_each_within_one_of_its_share(seed, m):
    rng = np.random.default_rng(seed)
    weight = rng.dirichlet(np.ones(m))
    counts = np.bincount(resample(weight, rng), minlength=m)
    assert counts.sum() == m
    assert (np.abs(counts - m * weight) < 1 + 1e-9).all()


def test_cells_are_drawn_by_their_likelihood_and_never_where_nan():
    costs = np.array([[0.0, np.nan], [0.2, 0.1]])
    ix, iy = draw_cells(costs, 0.1, 20000, np.random.default_rng(0))
    share = np.bincount(2 * ix + iy, minlength=4) / 20000
    expected = np.array([1.0, 0.0, np.exp(-2), np.exp(-1)])
    np.testing.assert_allclose(share, expected / expected.sum(), atol=0.015)


def test_the_densest_mode_ignores_a_far_minority():
    rng = np.random.default_rng(1)
    heading = np.pi + rng.normal(0, 0.01, 100)
    particles = np.column_stack([rng.normal(0, 0.03, (100, 2)), np.angle(np.exp(1j * heading))])
    particles[:30, :2] += 2.0
    mode = densest_mode(particles)
    assert mode.sum() == 70
    x, y, turn = mean_pose(particles[mode])
    assert np.hypot(x, y) < 0.02
    assert abs(np.angle(np.exp(1j * (turn - np.pi)))) < 0.01

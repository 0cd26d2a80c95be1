"""The search for a start of ICP: a box that was moved decides nothing; sums are right."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from airground.config import Config
from airground.core.se3 import SE3
from airground.refinement.local_search import _shift_costs, search_nearby

TRUTH = SE3.from_heading(0.4, (0.12, -0.2, 0.35))
BOXES = ((-0.9, -0.6, 0.4), (0.8, 0.5, 0.3), (-0.5, 0.9, 0.5), (0.9, -0.8, 0.4))
"""Middle and height of boxes with sides of 0.5 m [m]."""


def world(boxes, spacing_m=0.02):
    """(N, 3) points over 4 x 4 m of floor with boxes on it."""
    x, y = np.meshgrid(*[np.arange(-2, 2, spacing_m)] * 2)
    z = np.zeros_like(x)
    for bx, by, high in boxes:
        z[(np.abs(x - bx) < 0.25) & (np.abs(y - by) < 0.25)] = high
    return np.column_stack([x.ravel(), y.ravel(), z.ravel()])


def off(found):
    """Horizontal distance of the middle [m] and angle [deg] from the truth."""
    assert found is not None
    turn = (found @ TRUTH.inverse()).angle()
    return np.linalg.norm((found.translation - TRUTH.translation)[:2]), np.rad2deg(turn)


def start(x=0.0, y=0.0, heading_deg=0.0):
    """The truth, moved and turned."""
    turned = SE3.from_heading(TRUTH.heading() + np.deg2rad(heading_deg)).rotation
    return SE3(turned, TRUTH.translation + np.array([x, y, 0.1]))


@pytest.mark.parametrize("heading_deg", [0.0, 7.0, -15.0])
@pytest.mark.parametrize("shift", [(0.0, 0.0), (0.5, -0.3)])
def test_the_place_is_found_from_anywhere_in_the_searched_range(shift, heading_deg):
    ground = (TRUTH @ world(BOXES)).astype(np.float32)
    found = search_nearby(world(BOXES), ground, start(*shift, heading_deg), Config().refinement)
    metres, degrees = off(found)
    assert metres < 0.03
    assert degrees <= 1.01
    assert found.translation[2] == pytest.approx(TRUTH.translation[2], abs=0.005)


def test_one_box_that_moved_far_does_not_pull():
    """A box as high as all others together: squares of its differences would outweigh theirs."""
    aerial = world([*BOXES, (0.0, 0.1, 2.0)])
    ground = (TRUTH @ world([*BOXES, (0.3, 0.1, 2.0)])).astype(np.float32)
    metres, degrees = off(search_nearby(aerial, ground, start(0.2, 0.1), Config().refinement))
    assert metres < 0.05
    assert degrees <= 2.01


def test_maps_that_do_not_overlap_have_no_start():
    ground = (TRUTH @ world(BOXES)).astype(np.float32)
    assert search_nearby(world(BOXES), ground, start(9.0), Config().refinement) is None


@pytest.mark.kernel
@given(st.integers(0, 2**32 - 1), st.integers(0, 4))
@settings(max_examples=30, deadline=None)
def test_costs_are_those_of_the_obvious_sum(seed, reach):
    rng = np.random.default_rng(seed)
    aerial, ground = (
        np.where(rng.random(shape) < 0.2, np.nan, rng.normal(0, 0.4, shape)).astype(np.float32)
        for shape in rng.integers(1, 9, (2, 2))
    )
    first, tolerance = rng.integers(-6, 7, 2), np.float32(0.3)
    costs, counts = _shift_costs(aerial, ground, first, reach, tolerance)
    for sx, sy in np.ndindex(costs.shape):
        differences = [
            min(abs(float(aerial[cell]) - float(ground[tuple(below)])), 0.3)
            for cell in np.ndindex(aerial.shape)
            if (below := np.array(cell) + first + (sx - reach, sy - reach)).min() >= 0
            and (below < ground.shape).all()
            and np.isfinite(aerial[cell])
            and np.isfinite(ground[tuple(below)])
        ]
        assert counts[sx, sy] == len(differences)
        expected = np.mean(differences) if differences else np.inf
        assert costs[sx, sy] == pytest.approx(expected, abs=1e-6)

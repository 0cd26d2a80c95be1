"""How well the vertical is known, against least squares over all that is unknown."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from airground.slam import so3
from airground.slam.inertial.preintegration import GRAVITY
from airground.slam.known_vertical import BIAS_MPS2, LEVEL_SIGMA, READING_MPS2, KnownVertical

STEP_S = 0.1
MOUNTED = so3.exp(np.array([0.4, -1.2, 0.7]))
"""Axes of an accelerometer in its robot: any."""


def sigma_after(headings: NDArray, mounted: NDArray = MOUNTED) -> float:
    """As `KnownVertical` states it after so many images, at `STEP_S`."""
    known = KnownVertical()
    for index, heading in enumerate(headings):
        sigma = known.sigma(
            round(index * STEP_S * 1e9), so3.exp(np.array([0, 0, heading])) @ mounted
        )
    return sigma


def by_least_squares(headings: NDArray) -> float:
    """The same from the normal equations of the two angles and the bias, reading by reading."""
    information = np.zeros((5, 5))
    information[2:, 2:] = np.eye(3) / BIAS_MPS2**2
    for heading in headings[1:]:
        R_map_imu = so3.exp(np.array([0, 0, heading])) @ MOUNTED
        # Where a map leans by (a, b) about x and y, an accelerometer reads (b, -a) along these.
        leaning = GRAVITY * np.array([[0.0, 1.0], [-1.0, 0.0], [0.0, 0.0]])
        reading = np.column_stack([R_map_imu.T @ leaning, np.eye(3)])
        information += reading.T @ reading * STEP_S / READING_MPS2**2
    covariance = np.linalg.inv(information)[:2, :2]
    return float(np.sqrt(np.trace(covariance) / 2))


@pytest.mark.parametrize("turn", [0.3, 1.0, np.pi, 20.0])
def test_it_is_that_of_least_squares(turn: float) -> None:
    headings = turn * np.sin(np.linspace(0, 3, 200))
    assert sigma_after(headings) == pytest.approx(by_least_squares(headings), rel=1e-6)


def test_a_robot_that_never_turns_knows_it_as_at_rest() -> None:
    assert sigma_after(np.zeros(1)) == pytest.approx(LEVEL_SIGMA)
    assert sigma_after(np.zeros(3000)) == pytest.approx(LEVEL_SIGMA)


def test_half_a_turn_tells_the_bias_apart() -> None:
    half = np.concatenate([np.zeros(50), np.full(50, np.pi)])
    expected = READING_MPS2 / GRAVITY / np.sqrt(99 * STEP_S)
    assert sigma_after(half) == pytest.approx(expected, rel=0.01)
    assert sigma_after(half[:51]) > sigma_after(half)


@given(st.lists(st.floats(-4, 4), min_size=2, max_size=40))
def test_more_readings_never_know_less_and_axes_do_not_matter(headings: list[float]) -> None:
    sigmas = [sigma_after(np.array(headings[:n])) for n in range(1, len(headings) + 1)]
    assert all(later <= earlier * (1 + 1e-9) for earlier, later in pairwise(sigmas))
    assert sigma_after(np.array(headings), np.eye(3)) == pytest.approx(sigmas[-1], rel=1e-6)

"""How well the vertical is known, against least squares over all that is unknown."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from airground.core.messages import ImuNoise
from airground.slam import so3
from airground.slam.inertial.preintegration import GRAVITY
from airground.slam.known_vertical import (
    ASSUMED_SIGMA,
    FIRST_READING_S,
    READING_MPS2,
    KnownVertical,
)

STEP_S = 0.1
MOUNTED = so3.exp(np.array([0.4, -1.2, 0.7]))
"""Axes of an accelerometer in its robot: any."""
DENSITY, WALK = 2e-3, 3e-3
STEADY, WALKING = ImuNoise(2e-4, 2e-5, DENSITY, 0.0), ImuNoise(2e-4, 2e-5, DENSITY, WALK)
BIAS_MPS2, OF_A_SECOND = STEADY.accelerometer_bias_sigma, READING_MPS2**2 + DENSITY**2
AT_REST = float(np.sqrt(BIAS_MPS2**2 + OF_A_SECOND / FIRST_READING_S) / GRAVITY)


def known_after(
    headings: NDArray, mounted: NDArray = MOUNTED, noise: ImuNoise | None = STEADY
) -> KnownVertical:
    """After so many images, at `STEP_S`."""
    known = KnownVertical(noise)
    for index, heading in enumerate(headings):
        known.read(round(index * STEP_S * 1e9), so3.exp(np.array([0, 0, heading])) @ mounted)
    return known


def by_least_squares(headings: NDArray, walk: float) -> float:
    """The same from the normal equations of the two angles and the bias at every reading."""
    count = len(headings)
    information = np.zeros((2 + 3 * count, 2 + 3 * count))
    information[2:5, 2:5] += np.eye(3) / BIAS_MPS2**2
    # Where a map leans by (a, b) about x and y, an accelerometer reads (b, -a) along these.
    leaning = GRAVITY * np.array([[0.0, 1.0], [-1.0, 0.0], [0.0, 0.0]])
    for index, heading in enumerate(headings):
        R_map_imu = so3.exp(np.array([0, 0, heading])) @ MOUNTED
        seconds = STEP_S if index else FIRST_READING_S
        # Along the map's vertical it reads the bias and gravity, whose strength says nothing here.
        reading = np.zeros((2, 2 + 3 * count))
        bias = slice(2 + 3 * index, 5 + 3 * index)
        reading[:, :2], reading[:, bias] = leaning[:2], R_map_imu[:2]
        information += reading.T @ reading * seconds / OF_A_SECOND
        if index:
            step = np.zeros((3, 2 + 3 * count))
            step[:, bias], step[:, bias.start - 3 : bias.start] = np.eye(3), -np.eye(3)
            information += step.T @ step / (walk**2 * STEP_S)
    covariance = np.linalg.inv(information)[:2, :2]
    return float(np.sqrt(np.trace(covariance) / 2))


@pytest.mark.parametrize("turn", [0.3, 1.0, np.pi, 20.0])
def test_it_is_that_of_least_squares(turn: float) -> None:
    headings = turn * np.sin(np.linspace(0, 3, 60))
    found = known_after(headings, noise=WALKING).sigma
    assert found == pytest.approx(by_least_squares(headings, WALK), rel=1e-3)
    # A bias that hardly walks is one that does not.
    found = known_after(headings, noise=STEADY).sigma
    assert found == pytest.approx(by_least_squares(headings, 1e-5), rel=1e-3)


def test_a_robot_that_never_turns_knows_it_by_the_bias_alone() -> None:
    assert known_after(np.zeros(1)).sigma == pytest.approx(AT_REST, rel=1e-4)
    assert known_after(np.zeros(3000)).sigma == pytest.approx(BIAS_MPS2 / GRAVITY, rel=1e-3)


def test_what_was_known_at_the_start_is_kept() -> None:
    known = known_after(np.linspace(0, 6, 100))
    assert known.sigma_at_start == pytest.approx(AT_REST, rel=1e-4)
    assert known.sigma < known.sigma_at_start / 2


def test_half_a_turn_tells_the_bias_apart() -> None:
    half = np.concatenate([np.zeros(50), np.full(50, np.pi)])
    read_s = FIRST_READING_S + 99 * STEP_S
    expected = np.sqrt(OF_A_SECOND / read_s) / GRAVITY
    assert known_after(half).sigma == pytest.approx(expected, rel=0.02)
    assert known_after(half[:51]).sigma > known_after(half).sigma


def test_a_bias_that_walks_hides_the_vertical_for_longer() -> None:
    slow = np.linspace(0, 1, 300)
    assert known_after(slow, noise=WALKING).sigma > 1.2 * known_after(slow, noise=STEADY).sigma


def test_without_an_accelerometer_a_robot_is_taken_to_stand_level() -> None:
    known = known_after(np.linspace(0, 6, 100), noise=None)
    assert known.sigma == known.sigma_at_start == ASSUMED_SIGMA


@given(st.lists(st.floats(-4, 4), min_size=2, max_size=40))
def test_more_readings_never_know_less_and_axes_do_not_matter(headings: list[float]) -> None:
    sigmas = [
        known_after(np.array(headings[:n]), noise=WALKING).sigma
        for n in range(1, len(headings) + 1)
    ]
    assert all(later <= earlier * (1 + 1e-9) for earlier, later in pairwise(sigmas))
    level = known_after(np.array(headings), np.eye(3), noise=WALKING).sigma
    assert level == pytest.approx(sigmas[-1], rel=1e-6)

"""Nearest points of a moving cloud are those of all pairs; few of them are searched for."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from airground.core.se3 import SE3
from airground.refinement.correspondences import CANDIDATES, Correspondences
from airground.refinement.surfels import Surfels, make_surfels

pytestmark = pytest.mark.kernel


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(0)


def heap(rng: np.random.Generator, count: int) -> NDArray[np.float32]:
    """(count, 3) points of a wavy surface of 2 x 2 m."""
    xy = rng.uniform(-1, 1, (count, 2))
    z = 0.2 * np.sin(5 * xy[:, 0]) + rng.normal(0, 0.003, count)
    return np.column_stack([xy, z]).astype(np.float32)


def by_all_pairs(
    moved: NDArray[np.float64], target: Surfels
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    difference = moved[:, None] - target.points[None]
    squared = (difference**2).sum(axis=2)
    index = squared.argmin(axis=1)
    return index, squared[np.arange(len(moved)), index]


@pytest.mark.parametrize("step_m", [0.1, 0.01, 0.001])
def test_nearest_points_are_those_of_all_pairs(rng: np.random.Generator, step_m: float) -> None:
    target = make_surfels(heap(rng, 4000), 0.1)
    moved = heap(rng, 500) + rng.normal(0, 0.1, (500, 3))
    found = Correspondences(target, len(moved))
    within_m = 0.15
    for _ in range(8):
        index, squared = found.nearest(moved, within_m)
        true_index, true_squared = by_all_pairs(moved, target)
        near = true_squared <= within_m**2
        assert 0 < near.sum() < len(moved)
        assert (index[near] == true_index[near]).all()
        np.testing.assert_allclose(squared[near], true_squared[near], rtol=1e-9)
        assert (squared[~near] > within_m**2).all()
        turn = SE3.from_rotation_vector(step_m * rng.normal(size=3))
        moved = turn @ moved + step_m * rng.normal(size=3)


def test_points_that_move_little_are_not_searched_for_again(rng: np.random.Generator) -> None:
    target = make_surfels(heap(rng, 4000), 0.1)
    searched = []

    class Counted(Surfels):
        def neighbours(
            self, points: NDArray[np.float64], count: int
        ) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
            searched.append(len(points))
            return super().neighbours(points, count)

    counted = Counted(target.points, target.tree, target.cloud)
    moved = np.asarray(heap(rng, 500), np.float64)
    found = Correspondences(counted, len(moved))
    for _ in range(10):
        found.nearest(moved, 1.0)
        moved = moved + 0.001
    assert searched[0] == len(moved)
    assert sum(searched[1:]) < 0.1 * len(moved)


def test_a_target_of_few_points_is_searched(rng: np.random.Generator) -> None:
    target = make_surfels(heap(rng, CANDIDATES - 2), 0.001)
    assert len(target) == CANDIDATES - 2
    moved = np.asarray(heap(rng, 50), np.float64)
    index, _ = Correspondences(target, len(moved)).nearest(moved, 1.0)
    assert (index == by_all_pairs(moved, target)[0]).all()

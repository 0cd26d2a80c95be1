"""Steps of made-up series: found where they are, and rarely where there is only noise."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from evaluation.table.steps import NOISE_FACTOR, noise, step_places


def levels(*parts: tuple[float, int]) -> np.ndarray:
    return np.concatenate([np.full(count, value) for value, count in parts])


def test_a_step_is_found_at_its_first_value() -> None:
    assert step_places(levels((1.0, 6), (1.2, 5)), 0.1) == [6]
    assert step_places(levels((1.0, 4), (2.0, 3), (0.5, 4)), 0.1) == [4, 7]


def test_the_last_value_alone_can_be_a_step() -> None:
    assert step_places(np.array([1.0, 1.3]), 0.1) == [1]
    assert step_places(np.array([1.0, 1.0, 1.3]), 0.1) == [2]
    assert step_places(levels((1.0, 8), (1.3, 1)), 0.1) == [8]


def test_smaller_changes_than_matter_are_steps_only_when_they_last() -> None:
    assert step_places(levels((1.0, 8), (1.05, 1)), 0.1) == []
    assert step_places(levels((1.0, 8), (1.05, 8)), 0.1) == [8]


def test_missing_values_are_passed_over() -> None:
    series = levels((np.nan, 3), (1.0, 4), (np.nan, 1), (2.0, 4))
    assert step_places(series, 0.1) == [8]
    assert step_places(levels((np.nan, 4)), 0.1) == []
    assert step_places(np.array([]), 0.1) == []


def test_a_failure_is_a_level_of_its_own() -> None:
    assert step_places(levels((1.0, 4), (np.inf, 1), (1.0, 4)), 0.1) == [4, 5]
    assert step_places(levels((np.inf, 5)), 0.0) == []


def test_noise_is_that_of_neighbours_whatever_the_steps() -> None:
    rng = np.random.default_rng(1)
    series = rng.normal(0, 0.3, 400) + levels((0.0, 200), (50.0, 200))
    assert noise(series) == pytest.approx(0.3, rel=0.15)
    assert noise(np.array([4.0, 5.0])) == 0.0
    assert noise(np.array([4.0, 4.0, 5.0])) == 0.0


def test_the_fit_is_the_best_of_all() -> None:
    rng = np.random.default_rng(2)
    for _ in range(20):
        series = rng.normal(0, 1, 7) + levels((0.0, 3), (3.0, 4))
        penalty = max(1.0, NOISE_FACTOR * noise(series))
        found = cost(series, step_places(series, 1.0), penalty)
        everywhere = [
            places for count in range(7) for places in itertools.combinations(range(1, 7), count)
        ]
        best = min(cost(series, list(places), penalty) for places in everywhere)
        assert found == pytest.approx(best)


def cost(series: np.ndarray, places: list[int], penalty: float) -> float:
    """Sum of absolute deviations from the segments' medians, and the penalties."""
    parts = np.split(series, places)
    return penalty * len(places) + sum(float(np.abs(p - np.median(p)).sum()) for p in parts)


def test_noise_alone_steps_at_few_places() -> None:
    rng = np.random.default_rng(3)
    found = [step_places(rng.normal(0, 1, 20), 0.0) for _ in range(100)]
    assert sum(map(len, found)) < 0.06 * 100 * 19

"""The laws of comparing two results: symmetry, order, coverage, and how often chance alarms."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy import stats

from evaluation.table.comparison import (
    NO_EFFECT,
    adjusted,
    least_paired_p,
    least_two_sample_p,
    median,
    paired_effect,
    subtract,
    two_sample_effect,
)

NUMBERS = st.floats(-9, 9, width=16) | st.sampled_from([np.inf, -np.inf])
DIFFERENCES = arrays(np.float64, st.integers(2, 9), elements=NUMBERS)
FINITE = arrays(np.float64, st.integers(2, 9), elements=st.floats(-1, 1, width=16))
FEW = settings(max_examples=25, deadline=None)


@FEW
@given(DIFFERENCES)
def test_exchanging_the_sides_turns_the_sign_and_keeps_p(differences: np.ndarray) -> None:
    there, back = paired_effect(differences, False), paired_effect(-differences, False)
    assert back.value == -there.value
    assert (back.low, back.high) == (-there.high, -there.low)
    assert back.p == pytest.approx(there.p)


@FEW
@given(FINITE)
def test_shares_are_as_symmetric(differences: np.ndarray) -> None:
    there, back = paired_effect(differences, True), paired_effect(-differences, True)
    assert (back.value, back.low, back.high) == pytest.approx(
        (-there.value, -there.high, -there.low)
    )
    assert back.p == pytest.approx(there.p)


@FEW
@given(DIFFERENCES, st.integers(0, 8))
def test_a_new_failure_never_looks_better(differences: np.ndarray, which: int) -> None:
    failed = differences.copy()
    failed[which % len(failed)] = np.inf
    before, after = paired_effect(differences, False), paired_effect(failed, False)
    assert after.value >= before.value
    assert after.high >= before.high


@FEW
@given(DIFFERENCES)
def test_the_interval_holds_the_value(differences: np.ndarray) -> None:
    effect = paired_effect(differences, False)
    assert effect.low <= effect.value <= effect.high


def test_no_difference_is_no_effect() -> None:
    assert paired_effect(np.zeros(7), False) == NO_EFFECT
    assert two_sample_effect(np.ones(4), np.ones(5), False) == NO_EFFECT
    failed = np.full(4, np.inf)
    assert two_sample_effect(failed, failed, False) == NO_EFFECT


def test_failing_on_both_sides_is_no_difference() -> None:
    made = subtract(np.array([np.inf, 2.0, np.inf]), np.array([np.inf, np.inf, 1.0]))
    assert made.tolist() == [0.0, -np.inf, np.inf]


def test_medians_may_be_failures() -> None:
    assert median(np.array([1.0, np.inf, np.inf])) == np.inf
    assert median(np.array([1.0, np.inf])) == np.inf
    assert median(np.array([-np.inf, np.inf])) == 0.0
    assert np.isnan(median(np.array([])))


def test_p_is_wilcoxons_where_that_is_exact() -> None:
    rng = np.random.default_rng(3)
    for _ in range(5):
        differences = rng.normal(0.4, 1, 9)
        expected = stats.wilcoxon(differences, method="exact").pvalue
        assert paired_effect(differences, False).p == pytest.approx(expected)


def test_p_is_mann_and_whitneys_where_that_is_exact() -> None:
    rng = np.random.default_rng(4)
    before, after = rng.normal(0, 1, 6), rng.normal(1, 1, 7)
    expected = stats.mannwhitneyu(before, after, method="exact").pvalue
    assert two_sample_effect(before, after, False).p == pytest.approx(expected)


def test_the_least_p_is_reached_by_unanimous_observations() -> None:
    assert paired_effect(np.arange(1.0, 9.0), False).p == pytest.approx(least_paired_p(8))
    made = two_sample_effect(np.arange(5.0), np.arange(10.0, 16.0), False)
    assert made.p == pytest.approx(least_two_sample_p(5, 6))


@pytest.mark.parametrize("share", [False, True])
@pytest.mark.parametrize("count", [6, 9])
def test_intervals_of_few_pairs_hold_the_truth_as_often_as_they_say(
    count: int, share: bool
) -> None:
    rng = np.random.default_rng(5)
    held = 0
    for _ in range(200):
        made = paired_effect(rng.normal(0.3, 1.0, count), share)
        held += made.low <= 0.3 <= made.high
    # 3 standard deviations of 200 draws below the 95 % that are promised.
    assert held / 200 >= 0.904


def test_intervals_of_two_samples_hold_the_truth_as_often_as_they_say() -> None:
    rng = np.random.default_rng(6)
    held = 0
    for _ in range(100):
        before, after = rng.normal(0.0, 1.0, 6), rng.normal(0.5, 1.0, 6)
        made = two_sample_effect(before, after, True)
        held += made.low <= 0.5 <= made.high
    assert held / 100 >= 0.885


def test_chance_alarms_as_often_as_it_may() -> None:
    rng = np.random.default_rng(7)
    alarms = sum(paired_effect(rng.standard_t(3, 8), False).p <= 0.05 for _ in range(400))
    # 3 standard deviations of 400 draws above the 5 % that are allowed.
    assert alarms / 400 <= 0.083


def test_holm_by_hand() -> None:
    assert adjusted([0.01, 0.04, 0.03]) == pytest.approx([0.03, 0.06, 0.06])
    assert adjusted([0.9, 0.8]) == pytest.approx([1.0, 1.0])
    assert adjusted([]) == []


@given(st.lists(st.floats(0, 1), min_size=1, max_size=20))
def test_holm_keeps_the_order_and_only_raises(p_values: list[float]) -> None:
    made = adjusted(p_values)
    assert all(a >= p for a, p in zip(made, p_values, strict=True))
    order = np.argsort(p_values, kind="stable")
    assert (np.diff(np.array(made)[order]) >= 0).all()
    assert max(made) <= 1


def test_the_same_results_give_the_same_verdict() -> None:
    rng = np.random.default_rng(8)
    before, after = rng.normal(0, 1, 12), rng.normal(1, 1, 12)
    assert two_sample_effect(before, after, False) == two_sample_effect(before, after, False)

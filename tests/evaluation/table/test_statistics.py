"""Statistics keep failures, and agree with textbook values."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import binomtest

from evaluation.table.intervals import median_interval, quantile, quantiles, rate_within, wilson

numbers = st.lists(st.floats(-1e3, 1e3), min_size=1, max_size=40)


@given(numbers, st.floats(0, 1))
def test_quantile_agrees_with_numpy_where_nothing_failed(values: list[float], q: float) -> None:
    assert quantile(values, q) == pytest.approx(float(np.quantile(values, q)), abs=1e-6)


@given(numbers, st.integers(0, 20), st.floats(0, 1))
def test_failures_only_ever_raise_a_quantile(values: list[float], failed: int, q: float) -> None:
    assert quantile([*values, *[np.nan] * failed], q) >= quantile(values, q) - 1e-9


def test_a_median_that_failures_reach_is_infinite() -> None:
    assert quantile([0.1, 0.2, np.nan, np.inf], 0.5) == np.inf
    assert quantile([0.1, 0.2, 0.3, np.nan, np.inf], 0.5) == 0.3
    spread = quantiles([0.1, 0.1, 0.1, np.nan])
    assert (spread.median, spread.p95) == (0.1, np.inf)


def test_no_values_have_no_quantile() -> None:
    assert np.isnan(quantile([], 0.5))


@pytest.mark.parametrize(("successes", "total"), [(0, 41), (37, 41), (41, 41), (1, 3)])
def test_wilson_agrees_with_scipy(successes: int, total: int) -> None:
    expected = binomtest(successes, total).proportion_ci(method="wilson")
    made = wilson(successes, total)
    assert (made.low, made.high) == pytest.approx((expected.low, expected.high), abs=1e-6)


def test_wilson_refuses_more_successes_than_trials() -> None:
    with pytest.raises(ValueError, match="successes"):
        wilson(5, 4)


def test_failures_are_not_within_any_limit() -> None:
    made = rate_within([0.1, 0.3, np.nan, np.inf], 0.25)
    assert (made.successes, made.total) == (1, 4)


def test_bootstrap_interval_holds_the_true_median_about_as_often_as_it_says() -> None:
    rng = np.random.default_rng(4)
    hits = 0
    for _ in range(200):
        made = median_interval(rng.normal(2.0, 1.0, 40), rng, resamples=300)
        hits += made.low <= 2.0 <= made.high
    assert 0.88 <= hits / 200 <= 0.99


def test_bootstrap_is_the_same_for_the_same_seed() -> None:
    values = [0.1, 0.4, np.nan, 0.2]
    one, two = (median_interval(values, np.random.default_rng(1)) for _ in range(2))
    assert one == two


def test_shares_that_hardly_vary_keep_two_decimals() -> None:
    assert wilson(0, 2484).text() == "0.00 %\n0 of 2484; 0.00 to 0.15 %"
    assert wilson(2528, 2532).text() == "99.84 %\n2528 of 2532; 99.59 to 99.94 %"
    assert wilson(2484, 2532).text() == "98.1 %\n2484 of 2532; 97 to 99 %"
    assert wilson(0, 0).text() == "-"

"""Particles that know their error are seen as such, and so are those that are too sure."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
import scipy.stats
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import binom, chi2

from airground.core.belief import Belief
from airground.core.se3 import SE3
from airground.core.sighting import Sighting
from evaluation.judge.claims import ELLIPSES, METRIC, Localizations, localizations
from evaluation.show.report.calibration import calibration_figures, calibration_table
from evaluation.table.rows import ResultTable, Row
from evaluation.table.truth_errors import distance_in, squared_mahalanobis, true_T_ground_mav
from sim.recording.truth import Truth
from tests.evaluation.synthetic_results import BEST, make_table

COVARIANCE = np.array([[0.04, 0.015], [0.015, 0.01]])
BELIEFS, PARTICLES = 5000, 200


def drawn(believed: float) -> Localizations:
    """Errors drawn from `COVARIANCE`, and particles from it times `believed`."""
    rng = np.random.default_rng(5)
    shape = np.linalg.cholesky(COVARIANCE)
    off = rng.normal(size=(BELIEFS, 2)) @ shape.T
    spread, distance = np.zeros(BELIEFS), np.zeros(BELIEFS)
    for index in range(BELIEFS):
        particles = np.sqrt(believed) * rng.normal(size=(PARTICLES, 2)) @ shape.T
        covariance = np.cov(particles.T)
        spread[index] = np.sqrt(np.trace(covariance))
        distance[index] = distance_in(covariance, off[index])
    error = np.hypot(*off.T)
    return Localizations(error, spread, distance, np.arange(BELIEFS) % 2 == 0)


@pytest.mark.parametrize("believed", [1.0, 0.25, 4.0])
def test_what_is_covered_is_what_theory_says(believed: float) -> None:
    """A distance in the covariance of drawn particles is Hotelling's T squared."""
    found = drawn(believed)
    n = PARTICLES
    squared = scipy.stats.f(2, n - 2, scale=2 * (n - 1) / (n - 2) / believed)
    for part in (found, found.only_accepted()):
        for share in ELLIPSES:
            covered = squared.cdf(chi2.ppf(share, 2))
            low, high = binom.ppf([1e-4, 1 - 1e-4], len(part), covered)
            assert low <= part.coverage(share).successes <= high
        assert part.mean_normalized_error() == pytest.approx(squared.mean() / 2, rel=0.08)
        median = squared.median() / chi2.median(2)
        assert part.median_normalized_error() == pytest.approx(median, rel=0.1)


def test_a_belief_that_is_too_sure_is_distinguished_from_one_that_is_right() -> None:
    right, sure = drawn(1.0), drawn(0.25)
    for share in ELLIPSES:
        observed = right.coverage(share)
        assert observed.low - 0.01 < share < observed.high + 0.01
        assert sure.coverage(share).high < share - 0.2


numbers = st.floats(-3, 3)


@given(st.lists(numbers, min_size=4, max_size=4), numbers, numbers)
def test_the_distance_does_not_depend_on_the_axes(entries: list[float], x: float, y: float) -> None:
    change = np.reshape(entries, (2, 2)) + 4 * np.eye(2)
    if np.linalg.cond(change) > 1e3:
        return
    error = np.array([x, y])
    changed = distance_in(change @ COVARIANCE @ change.T, change @ error)
    assert changed == pytest.approx(distance_in(COVARIANCE, error), rel=1e-6, abs=1e-9)


@pytest.mark.parametrize("covariance", [np.zeros((2, 2)), np.diag([0.04, 0.0])])
def test_particles_in_one_place_or_line_leave_nothing_else_possible(covariance: Any) -> None:
    distance = distance_in(covariance, [0.01, 0.0])
    assert distance == np.inf
    one = Localizations(*(np.array([v]) for v in (0.01, 0.0, distance)), np.array([True]))
    assert one.coverage(0.99).successes == 0
    assert one.mean_normalized_error() == np.inf


def test_the_distance_is_that_of_the_particles() -> None:
    T_ground_mav = SE3.from_heading(0.7, (1.0, -2.0, 0.4))
    T_mav_camera, T_reference = (
        SE3.from_rotation_vector((np.pi, 0, 0), place) for place in ((2, 1, 2), (0.5, 0.8, 2))
    )
    sighting = SimpleNamespace(
        surface=SimpleNamespace(T_mav_camera=T_reference),
        mav_stamp_ns=5,
        T_mav_camera=T_mav_camera,
        ground_stamp_ns=4,
        T_ground_camera=SE3.identity(),
    )
    truth = SimpleNamespace(
        T_world_ground_camera=lambda stamp_ns: SE3.identity(),
        T_world_mav_camera=lambda stamp_ns: T_ground_mav @ T_mav_camera,
    )
    found = true_T_ground_mav(cast(Sighting, sighting), cast(Truth, truth))
    np.testing.assert_allclose(found.matrix(), T_ground_mav.matrix(), atol=1e-12)
    true_u = (T_ground_mav @ T_reference.translation)[:2]
    for off in ([0.0, 0.0], [0.1, -0.2]):
        belief = Belief(
            5, np.zeros((3, 3)), np.array([*(true_u + off), 0.7]), COVARIANCE,
            0.0, 0.0, T_ground_mav, True, "",
        )  # fmt: skip
        found = squared_mahalanobis(belief, cast(Sighting, sighting), cast(Truth, truth))
        assert found == pytest.approx(off @ np.linalg.inv(COVARIANCE) @ off)


def test_a_map_that_never_came_is_no_belief() -> None:
    rows = []
    for iteration, (error, spread, distance, claimed) in enumerate(
        [(0.1, 0.2, 0.5, 1.0), (0.3, 0.1, 18.0, 0.0), (np.nan, None, None, 0.0)], 1
    ):
        for metric, value in (
            ("error_m", error), ("spread_m", spread), (METRIC, distance), ("converged", claimed),
        ):  # fmt: skip
            if value is not None:
                rows.append(Row("a", 1, 0, BEST, "localization", metric, value, "", 0, iteration))
    table = ResultTable.from_rows(rows)
    found = localizations(table)
    np.testing.assert_array_equal(found.squared_mahalanobis, [0.5, 18.0])
    np.testing.assert_array_equal(found.only_accepted().error_m, [0.1])
    cells = {row[0]: row[1:] for row in calibration_table(table).rows}
    assert cells["localizations"] == ("2", "1")
    assert cells["true position in the 50 % ellipse"][0].startswith("50.0 %\n1 of 2;")
    assert cells["normalized error, mean"] == ("4.62", "0.25")


def test_the_rank_correlation_tells_whether_the_spread_predicts_the_error() -> None:
    ramp, even = np.arange(1.0, 6.0), np.ones(5, bool)
    assert Localizations(ramp, ramp**3, ramp, even).rank_correlation() == pytest.approx(1)
    assert Localizations(ramp, 1 / ramp, ramp, even).rank_correlation() == pytest.approx(-1)
    assert np.isnan(Localizations(ramp, np.ones(5), ramp, even).rank_correlation())


def test_the_figure_shows_every_belief() -> None:
    table = make_table(conditions=(BEST,)).scored()
    found = localizations(table)
    (drawing,) = calibration_figures(table, BEST)
    right = drawing.figure.axes[1]
    dots = [line for line in right.lines if line.get_marker() == "o"]
    assert sum(len(line.get_xdata()) for line in dots) == len(found)  # type: ignore[arg-type]
    assert BEST.label() in drawing.caption
    assert list(calibration_figures(ResultTable.from_rows([]), BEST)) == []

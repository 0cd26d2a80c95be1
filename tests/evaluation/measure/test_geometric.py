"""Baselines on heights and clouds, in worlds where the answer is known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from airground.core.cloud import PointCloud
from airground.core.se3 import SE3
from evaluation.measure.baselines.fpfh_ransac import ransac
from evaluation.measure.baselines.interface import Answer, Baseline, Given
from evaluation.measure.baselines.registration import impossible_turn
from evaluation.measure.baselines.table import BASELINES
from tests.evaluation.measure.closed_worlds import (
    T_GROUND_MAV,
    bare_floor,
    boxes_on_floor,
    error_of,
    given_of,
)

ON_HEIGHTS = ("zmssd", "ncc", "phase", "ours_first")
ON_CLOUDS = ("fpfh", "kiss", "ours_global", "icp", "ours_refined", "oracle")
CELL_M = 0.04


def answered(name: str, given: Given) -> Answer:
    """A baseline's answer; skips the test where its module is not installed."""
    baseline = named(name)
    if baseline.module:
        pytest.importorskip(baseline.module)
    return baseline.locate(given)


def named(name: str) -> Baseline:
    return next(baseline for baseline in BASELINES if baseline.name == name)


def noisy_prior() -> SE3:
    """About one standard deviation of the trials' noise on every axis, of the camera's pose."""
    turn = SE3.from_rotation_vector(np.deg2rad([2.0, -3.0, 3.0]))
    shift = np.array([0.15, -0.1, 0.1])
    return SE3((turn @ T_GROUND_MAV).rotation, T_GROUND_MAV.translation + shift)


@pytest.mark.parametrize("name", ON_HEIGHTS)
def test_heights_find_the_place_within_a_cell(name: str) -> None:
    given = given_of(boxes_on_floor())
    answer = answered(name, given)
    assert answer.T_ground_mav is not None
    off_m, off_deg = error_of(answer.T_ground_mav, given)
    assert off_m < 1.5 * CELL_M
    assert off_deg < 0.01


@pytest.mark.parametrize("name", ON_CLOUDS)
def test_clouds_find_the_place_precisely(name: str) -> None:
    prior = T_GROUND_MAV if name == "oracle" else noisy_prior()
    given = given_of(boxes_on_floor(), prior if named(name).prior != "none" else None)
    answer = answered(name, given)
    assert answer.T_ground_mav is not None
    off_m, off_deg = error_of(answer.T_ground_mav, given)
    assert off_m < 0.02
    assert off_deg < 0.5
    if name != "ours_global":  # which may wait for a second map
        assert answer.claimed, answer.refusal


@pytest.mark.parametrize("name", ["fpfh", "kiss", "ours_first", "ours_global", "ours_refined"])
def test_bare_floor_gives_no_claim_that_is_right_by_luck(name: str) -> None:
    """Ours must abstain; a baseline may be fooled, and then its claim is far off."""
    given = given_of(bare_floor(), noisy_prior() if named(name).prior != "none" else None)
    answer = answered(name, given)
    if name.startswith("ours"):
        assert not answer.claimed
    elif answer.claimed:
        assert answer.T_ground_mav is not None
        assert error_of(answer.T_ground_mav, given)[0] > 0.05


@pytest.mark.parametrize("name", [b.name for b in BASELINES if not b.views])
def test_empty_maps_are_abstained_from(name: str) -> None:
    given = given_of(boxes_on_floor(), noisy_prior() if named(name).prior != "none" else None)
    empty = replace(given, sighting=replace(given.sighting, ground_cloud=PointCloud.empty()))
    answer = answered(name, empty)
    assert not answer.claimed


@pytest.mark.parametrize("name", ["phase", "ours_first"])
def test_unknown_heading_is_abstained_from(name: str) -> None:
    given = given_of(boxes_on_floor())
    unknown = replace(given, sighting=replace(given.sighting, heading=None))
    answer = answered(name, unknown)
    assert answer.T_ground_mav is None
    assert "heading" in answer.refusal


@pytest.mark.parametrize("name", ["fpfh", "kiss", "phase", "ours_first"])
def test_same_seed_same_answer(name: str) -> None:
    points = boxes_on_floor()
    answers = [answered(name, given_of(points)).T_ground_mav for _ in range(2)]
    assert answers[0] is not None
    assert answers[1] is not None
    np.testing.assert_array_equal(answers[0].matrix(), answers[1].matrix())


def test_ransac_finds_the_motion_among_nine_in_ten_wrong_matches() -> None:
    rng = np.random.default_rng(3)
    motion = SE3.from_rotation_vector((0.1, -0.2, 2.0), (1.0, 2.0, -0.5))
    source = rng.uniform(-1, 1, (400, 3))
    target = rng.uniform(-2, 3, (400, 3))
    target[:40] = motion @ source[:40]
    found = ransac(source, target, lambda rotations: np.ones(len(rotations), np.bool_), rng)
    assert found is not None
    np.testing.assert_allclose(found.matrix(), motion.matrix(), atol=0.02)


def test_ransac_without_a_possible_motion_finds_none() -> None:
    points = np.random.default_rng(0).uniform(-1, 1, (50, 3))
    none_possible = ransac(
        points,
        points,
        lambda rotations: np.zeros(len(rotations), np.bool_),
        np.random.default_rng(0),
    )
    assert none_possible is None


def test_what_is_known_of_the_turn_follows_the_heading_word() -> None:
    given = given_of(bare_floor())
    turned = SE3.from_heading(T_GROUND_MAV.heading() + 1.0).rotation[None]
    tilted = SE3.from_rotation_vector((0.5, 0, 0)).rotation[None]
    assert impossible_turn(given, turned)[0] == pytest.approx(1.0)
    searching = given.config.model_copy(
        update={"localization": given.config.localization.model_copy(update={"heading": "search"})}
    )
    searched = replace(given, config=searching)
    assert impossible_turn(searched, turned)[0] == pytest.approx(0.0, abs=1e-6)
    assert impossible_turn(searched, tilted)[0] == pytest.approx(0.5)


def test_an_answer_without_pose_needs_a_reason() -> None:
    with pytest.raises(ValueError, match="needs a reason"):
        Answer(None)
    assert Answer(SE3.identity()).claimed


def test_names_are_unique_and_fit_into_metrics() -> None:
    names = [baseline.name for baseline in BASELINES]
    assert len(set(names)) == len(names)
    assert all(name.replace("_", "a").isalnum() and name.islower() for name in names)

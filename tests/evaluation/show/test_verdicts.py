"""Thresholds and marks in a recording of a run: what was refused, lost or claimed wrongly."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from airground.core.events import Aligned, BeliefUpdated
from airground.core.se3 import SE3
from evaluation.run.onlooker import Seen
from tests.evaluation.show.scripted_run import (
    BELIEF,
    CONFIG,
    SECOND,
    ReadBack,
    seen_events,
    written,
)

AWAY = SE3(np.eye(3), np.array([0.3, 0.0, 0.0]))
"""More than what is called located."""


def of(read: ReadBack, entity: str) -> list[tuple[int, float]]:
    """(stamp [ns], value) of a curve or of marks; empty without any."""
    if entity not in read.entities:
        return []
    stamps = [stamp for stamp in read.stamps_ns(entity) if stamp]  # 0: its look, at all times
    values = [value[0] for value in read.values(entity, "Scalars:scalars")]
    return list(zip(stamps, values, strict=True))


def changed(event: BeliefUpdated | Aligned) -> list[Seen]:
    """The scripted run with another belief or alignment."""
    return [
        replace(seen, event=event) if type(seen.event) is type(event) else seen
        for seen in seen_events()
    ]


@pytest.fixture(scope="module")
def good(tmp_path_factory: pytest.TempPathFactory) -> ReadBack:
    return ReadBack(written(tmp_path_factory.mktemp("good") / "run.rrd"))


def test_thresholds_stand_beside_what_they_judge(good: ReadBack) -> None:
    t = 3 * SECOND
    assert of(good, "/curves/spread_m/limit") == [(t, CONFIG.localization.converged_spread_m)]
    assert of(good, "/curves/overlap") == [(t, pytest.approx(0.8))]
    assert of(good, "/curves/overlap/limit") == [(t, CONFIG.localization.min_overlap)]
    assert of(good, "/curves/inliers") == [(t, pytest.approx(0.9))]
    assert of(good, "/curves/inliers/limit") == [(t, CONFIG.refinement.min_inliers)]


def test_a_good_run_has_no_mark_but_of_its_loss(good: ReadBack) -> None:
    judged = ("spread_m", "overlap", "inliers")
    marks = [*(f"/curves/{curve}/refused" for curve in judged), "/curves/corners/ground/lost"]
    for entity in (*marks, "/truth/error/translation_m/wrong_claim"):
        assert of(good, entity) == []
    assert of(good, "/curves/corners/mav/lost") == [(4 * SECOND, 0.0)]


def test_refusals_are_marked_where_they_were_made(tmp_path: Path) -> None:
    refused = replace(BELIEF, converged=False, refusal="spread")
    events = changed(BeliefUpdated(3 * SECOND, refused))
    read = ReadBack(written(tmp_path / "belief.rrd", events=events))
    assert of(read, "/curves/spread_m/refused") == [(3 * SECOND, pytest.approx(BELIEF.spread_m))]
    assert of(read, "/curves/overlap/refused") == []
    beside = replace(refused, overlap=0.1, refusal="no overlap")
    read = ReadBack(
        written(tmp_path / "beside.rrd", events=changed(BeliefUpdated(3 * SECOND, beside)))
    )
    assert of(read, "/curves/overlap/refused") == [(3 * SECOND, pytest.approx(0.1))]
    read = ReadBack(written(tmp_path / "alignment.rrd", events=seen_events(accepted=False)))
    assert of(read, "/curves/inliers/refused") == [(3 * SECOND, pytest.approx(0.9))]


def test_a_wrong_claim_is_marked_at_its_error_unless_it_was_refused(tmp_path: Path) -> None:
    away = replace(BELIEF, T_ground_mav=AWAY @ BELIEF.T_ground_mav)
    read = ReadBack(
        written(tmp_path / "wrong.rrd", events=changed(BeliefUpdated(3 * SECOND, away)))
    )
    ((stamp_ns, error_m),) = of(read, "/truth/error/translation_m/wrong_claim")
    assert (stamp_ns, error_m > 0.25) == (3 * SECOND, True)
    refused = replace(away, converged=False, refusal="spread")
    read = ReadBack(
        written(tmp_path / "refused.rrd", events=changed(BeliefUpdated(3 * SECOND, refused)))
    )
    assert of(read, "/truth/error/translation_m/wrong_claim") == []

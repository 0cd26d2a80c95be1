"""What a run without truth counts, and why nothing was aligned."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from airground.config import Config
from airground.core.belief import Alignment, Belief
from airground.core.events import Aligned, BeliefUpdated, Event, MavTracked, NotLocated, SurfaceCast
from airground.core.se3 import SE3
from airground.pipeline import NO_HEADING, NO_POSE
from evaluation.run.onlooker import Seen
from evaluation.run.pair_events import PairEvents
from tests.evaluation.show.scripted_run import mav_frame

BELIEF = Belief(
    stamp_ns=0,
    particles=np.zeros((2, 3)),
    estimate=np.zeros(3),
    covariance=np.eye(2),
    cost=1.0,
    height_offset=0.0,
    T_ground_mav=SE3.identity(),
    converged=True,
    refusal="",
)
REFUSALS = (
    "no overlap: only 10% of the aerial map lies on the ground map",
    "no overlap: only 20% of the aerial map lies on the ground map",
    "particles split: only 30% of them agree on a place",
)


def counted(*events: Event) -> PairEvents:
    found = PairEvents()
    for event in events:
        found.see(Seen(event, 0.0, mav_frame(0), None))
    return found


def refused(reason: str) -> BeliefUpdated:
    return BeliefUpdated(0, replace(BELIEF, converged=False, refusal=reason))


def aligned(accepted: bool) -> Aligned:
    refusal = "" if accepted else "clouds disagree: 10% of the aerial points"
    return Aligned(0, Alignment(0, SE3.identity(), 0.9, 0.01, accepted, refusal))


def surface() -> SurfaceCast:
    return SurfaceCast(0, None)  # type: ignore[arg-type]


def test_reasons_are_counted_by_kind_and_the_newest_is_given() -> None:
    found = counted(
        surface(), NotLocated(0, NO_POSE), NotLocated(0, NO_HEADING), *map(refused, REFUSALS)
    )
    assert found.located == 0
    assert found.not_located == {
        "no pose": 1,
        "no heading": 1,
        "no overlap": 2,
        "particles split": 1,
    }
    assert found.why(Config()) == REFUSALS[-1]


def test_an_accepted_alignment_needs_no_reason() -> None:
    found = counted(surface(), refused(REFUSALS[0]), BeliefUpdated(0, BELIEF), aligned(False))
    assert (found.located, found.refused) == (1, {"clouds disagree": 1})
    assert found.why(Config()) == "clouds disagree: 10% of the aerial points"
    found = counted(surface(), BeliefUpdated(0, BELIEF), aligned(False), aligned(True))
    assert found.why(Config()) is None


def test_without_a_surface_the_path_is_stated() -> None:
    poses = [SE3(np.eye(3), np.array([0.03 * k, 0.0, 2.0])) for k in range(5)]
    found = counted(*(MavTracked(k, pose) for k, pose in enumerate(poses)))
    assert found.why(Config()) == (
        "no surface: the MAV's camera moved 0.12 m while it was tracked, which gave 0 depth maps; "
        "a surface needs 3 near each other"
    )


def test_a_scale_that_depth_maps_cannot_use_is_stated() -> None:
    pose = SE3(np.eye(3), np.array([0.0, 0.0, 2.0]))
    found = counted(*(MavTracked(k, pose, scale_sigma=0.1 / k) for k in range(1, 4)))
    expected = "no surface: the scale of the MAV's map is known to 3%, and depth maps need 2%"
    assert found.why(Config()) == expected
    found = counted(MavTracked(0, pose, scale_sigma=np.inf))
    expected = "no surface: the scale of the MAV's map is unknown, and depth maps need 2%"
    assert found.why(Config()) == expected

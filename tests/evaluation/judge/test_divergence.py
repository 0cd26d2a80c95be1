"""Where two runs part, found in made traces that differ from a known time on."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from airground.core.se3 import SE3
from airground.core.trajectory import Trajectory
from evaluation.judge.accepted import Accepted, figure
from evaluation.judge.divergence import (
    Limits,
    MadeAlignment,
    MadeBelief,
    MadeSurface,
    Trace,
    first_divergence,
    hold,
    surface_difference,
)
from evaluation.judge.metrics import METRICS

STEP_NS = 33_333_333
IMAGES = 60
MAPS = [20 * STEP_NS, 40 * STEP_NS]
"""When a surface, a belief and an alignment are made."""
LIMITS = Limits(
    pose_m={"mav": 4e-4, "ground": 4e-4},
    surface_m=2e-4,
    surface_share=0.02,
    belief_m=1.5e-3,
    spread_m=0.01,
    aligned_m=5e-4,
    aligned_deg=0.01,
)
T_GROUND_MAV = SE3.from_heading(0.4, [1.0, 0.5, 0.0])
POINTS = np.random.default_rng(3).uniform(0, 1, (300, 3)).astype(np.float32)
KINDS = ["MAV's pose", "ground robot's pose", "surface", "belief", "alignment"]


def path(shift_m: float = 0.0, since: int = 0, missing: int | None = None) -> Trajectory:
    """A straight flight; from an image on it lies higher, and an image may have no pose."""
    stamps = [index * STEP_NS for index in range(IMAGES)]
    places = [[0.01 * i, 0.0, 2.0 + (shift_m if i >= since else 0.0)] for i in range(IMAGES)]
    kept = [index for index in range(IMAGES) if index != missing]
    poses = [SE3(np.eye(3), np.array(places[index])) for index in kept]
    return Trajectory.from_poses([stamps[index] for index in kept], poses)


def trace(name: str = "one") -> Trace:
    return Trace(
        name,
        {"mav": path(), "ground": path()},
        {stamp: MadeSurface(POINTS) for stamp in MAPS},
        {stamp: MadeBelief(T_GROUND_MAV, 0.2) for stamp in MAPS},
        {stamp: MadeAlignment(T_GROUND_MAV) for stamp in MAPS},
    )


def parted(other: Trace) -> dict[str, tuple[int, str]]:
    """When and how much each kind differs from the plain trace, where it does."""
    return {
        held.kind: (held.first.stamp_ns, held.first.how_much)
        for held in hold(trace(), other, LIMITS)
        if held.first is not None
    }


def test_equal_runs_do_not_part() -> None:
    helds = hold(trace(), trace("other"), LIMITS)
    assert [held.kind for held in helds] == KINDS
    assert [held.number for held in helds] == [IMAGES, IMAGES, 2, 2, 2]
    assert [held.first for held in helds] == [None] * len(KINDS)
    assert first_divergence(helds) is None


@pytest.mark.parametrize("robot", ["mav", "ground"])
@pytest.mark.parametrize("since", [0, 17, IMAGES - 1])
def test_a_pose_is_found_to_the_image(robot: str, since: int) -> None:
    poses = {"mav": path(), "ground": path()} | {robot: path(1e-3, since)}
    kind = KINDS[["mav", "ground"].index(robot)]
    found = parted(replace(trace(), poses=poses))
    assert found[kind] == (since * STEP_NS, "1.00 mm apart")
    assert set(found) <= {kind, "alignment"}  # the MAV's position is part of an alignment


def test_a_small_difference_is_none() -> None:
    assert parted(replace(trace(), poses={"mav": path(3e-4), "ground": path(3e-4)})) == {}


def test_an_image_that_is_tracked_in_one_run_only() -> None:
    other = replace(trace("other"), poses={"mav": path(missing=9), "ground": path()})
    assert parted(other) == {"MAV's pose": (9 * STEP_NS, "tracked only in one")}
    never = replace(trace("other"), poses={"ground": path()})
    assert parted(never)["MAV's pose"] == (0, "tracked only in one")


def test_a_surface_that_moved_or_lost_points() -> None:
    moved = MadeSurface(POINTS + np.array([0, 0, 1e-3], np.float32))
    found = parted(replace(trace(), surfaces={MAPS[0]: MadeSurface(POINTS), MAPS[1]: moved}))
    assert found == {"surface": (MAPS[1], "1.00 mm apart, +0.0 % points")}
    fewer = {stamp: MadeSurface(POINTS[:270]) for stamp in MAPS}
    assert parted(replace(trace(), surfaces=fewer))["surface"][0] == MAPS[0]


def test_a_surface_at_another_time() -> None:
    later = {MAPS[0] + STEP_NS: MadeSurface(POINTS), MAPS[1]: MadeSurface(POINTS)}
    assert parted(replace(trace(), surfaces=later)) == {
        "surface": (MAPS[0], "made only in one; one: next at 0.700 s")
    }


def test_surfaces_without_points() -> None:
    nothing = POINTS[:0]
    assert surface_difference(nothing, nothing) == (0.0, 0.0)
    assert surface_difference(POINTS, nothing) == (np.inf, 0.0)


def test_a_belief_that_moved_widened_or_was_refused() -> None:
    def found(other: MadeBelief) -> tuple[int, str]:
        beliefs = {MAPS[0]: MadeBelief(T_GROUND_MAV, 0.2), MAPS[1]: other}
        return parted(replace(trace("other"), beliefs=beliefs))["belief"]

    moved = SE3(T_GROUND_MAV.rotation, np.add(T_GROUND_MAV.translation, [0.003, 0.004, 0.0]))
    assert found(MadeBelief(moved, 0.2)) == (MAPS[1], "5.00 mm apart, spread +0.00 mm")
    assert found(MadeBelief(T_GROUND_MAV, 0.25)) == (MAPS[1], "0.00 mm apart, spread +50.00 mm")
    assert found(MadeBelief(None, 0.2)) == (MAPS[1], "claimed only in one")


def test_an_alignment_that_turned_or_was_refused() -> None:
    def found(other: SE3 | None) -> str:
        alignments = {stamp: MadeAlignment(other) for stamp in MAPS}
        return parted(replace(trace("other"), alignments=alignments))["alignment"][1]

    # About the MAV, so that its position stays.
    place = T_GROUND_MAV @ trace().mav_position(MAPS[0])
    turn = SE3.from_heading(np.deg2rad(0.5))
    about = SE3(np.eye(3), place) @ turn @ SE3(np.eye(3), -place)
    assert found(about @ T_GROUND_MAV) == "0.00 mm and 0.500° apart"
    assert found(None) == "accepted only in one"


def test_the_earliest_is_first_and_the_pipeline_s_order_breaks_ties() -> None:
    late = replace(trace(), poses={"mav": path(1e-3, 50), "ground": path()})
    refused = {stamp: MadeBelief(None, 0.2) for stamp in MAPS}
    none = {stamp: MadeAlignment(None) for stamp in MAPS}
    other = replace(late, beliefs=refused, alignments=none)
    first = first_divergence(hold(trace(), other, LIMITS))
    assert first is not None
    assert first.kind == "belief"
    assert first.first is not None
    assert first.first.stamp_ns == MAPS[0]


def test_limits_are_those_of_the_table_of_metrics() -> None:
    file = Path(__file__).parents[3] / "evaluation/accepted.json"
    accepted = Accepted.read(file).measured()
    limits = Limits.of(accepted)
    path_error = METRICS["mav_trajectory"]
    of_path = figure(path_error, accepted.samples["mav_trajectory"])
    assert limits.pose_m["mav"] == pytest.approx(path_error.matters * of_path)
    assert limits.surface_share == METRICS["completeness"].matters
    assert 0 < limits.aligned_m < 0.01

"""Which keyframes move, which hold them, and what becomes of observations that do not fit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from airground.config import KeyframeSlam
from airground.core.se3 import SE3
from airground.slam import map_adjustment, so3
from airground.slam.bundle_adjustment import Adjustment, InertialFactor, Role, States
from airground.slam.map_adjustment import MapAdjuster
from airground.slam.rig_state import RigState
from airground.slam.sparse_map import Keyframe, SparseMap
from tests.slam import bundle_problems
from tests.slam.bundle_problems import CAMERA, T_RIG_CAMERA, Problem

PARAMETERS = KeyframeSlam(window=4, fixed_keyframes=3, iterations=10)


def map_of(problem: Problem) -> SparseMap:
    """The true map of a problem, with what was measured."""
    sparse_map = SparseMap()
    ids = sparse_map.new_points(np.zeros((len(problem.points), 2)), 0)
    sparse_map.place(ids, problem.points)
    seen, states = problem.observations, problem.states
    for k in range(len(states)):
        rows = seen.keyframes == k
        state = RigState(
            states.rotations[k],
            states.positions[k],
            states.velocities[k],
            states.gyro_biases[k],
            states.accelerometer_biases[k],
        )
        sparse_map.keyframes.append(
            Keyframe(
                k,
                np.zeros((4, 4), np.uint8),
                state,
                seen.points[rows],
                seen.pixels[rows],
                seen.inverse_depths[rows],
            )
        )
    return sparse_map


def adjuster_of(sparse_map: SparseMap, problem: Problem) -> MapAdjuster:
    adjuster = MapAdjuster(sparse_map, CAMERA, T_RIG_CAMERA, PARAMETERS, 0.003)
    adjuster.motions = {factor.second: factor.preintegration for factor in problem.inertial}
    return adjuster


def shaken(sparse_map: SparseMap, moved: Sequence[int], seed: int = 3) -> None:
    """Put keyframes 2 cm and 0.5 deg beside the truth."""
    rng = np.random.default_rng(seed)
    for k in moved:
        state = sparse_map.keyframes[k].state
        sparse_map.keyframes[k].state = replace(
            state,
            rotation=state.rotation @ so3.exp(rng.normal(0, 0.005, 3)),
            position=state.position + rng.normal(0, 0.012, 3),
        )


def errors(sparse_map: SparseMap, problem: Problem) -> np.ndarray:
    """(K,) distance of each keyframe from the truth [m]."""
    here = np.array([k.state.position for k in sparse_map.keyframes])
    return np.linalg.norm(here - problem.states.positions, axis=1)


@pytest.fixture
def chosen(monkeypatch: pytest.MonkeyPatch) -> list[tuple[list[float], list[int]]]:
    """What goes into bundle adjustment, as places of keyframes along x and their roles."""
    calls = []
    adjust = map_adjustment.adjust

    def spy(states: States, roles: np.ndarray, *rest: object) -> Adjustment:
        calls.append((states.positions[:, 0].tolist(), roles.tolist()))
        return adjust(states, roles, *rest)  # type: ignore[arg-type]

    monkeypatch.setattr(map_adjustment, "adjust", spy)
    return calls


def numbers(places: list[float], problem: Problem) -> list[int]:
    return [int(np.argmin(np.abs(problem.states.positions[:, 0] - x))) for x in places]


@pytest.mark.parametrize("inertial", [False, True])
def test_the_newest_move_and_those_that_share_most_hold(inertial: bool, chosen: list) -> None:
    problem = bundle_problems.make(10, 400, 120)
    sparse_map = map_of(problem)
    # Keyframe 5, just before the window, shall share nothing with it, and 1 the most.
    late = sparse_map.seen_by([6, 7, 8, 9])
    before = sparse_map.keyframes[5]
    before.forget(np.isin(before.ids, late))
    first = sparse_map.keyframes[1]
    extra = np.setdiff1d(late, first.ids)
    pose = first.state.pose() @ T_RIG_CAMERA
    there = CAMERA.project(pose.inverse() @ sparse_map.positions[extra])
    front = np.isfinite(there).all(axis=1)
    first.see(extra[front], there[front], np.full(front.sum(), np.nan))
    shared = sparse_map.shared(late)
    assert shared[1] == shared[:6].max()
    adjuster_of(sparse_map, problem).adjust_window(inertial)
    [(places, roles)] = chosen
    held = sorted([1, 5, *[k for k in np.argsort(-shared[:5], kind="stable") if k != 1][:1]])
    assert numbers(places, problem) == [*held, 6, 7, 8, 9]
    assert roles == [Role.FIXED] * 3 + [Role.FREE] * 4


def test_with_an_imu_the_beginning_may_tilt_while_the_window_reaches_it(chosen: list) -> None:
    problem = bundle_problems.make(4, 200, 80)
    for inertial in (False, True):
        adjuster_of(map_of(problem), problem).adjust_window(inertial)
    assert chosen[0][1] == [Role.FIXED, Role.FREE, Role.FREE, Role.FREE]
    assert chosen[1][1] == [Role.GAUGE, Role.FREE, Role.FREE, Role.FREE]


def turned(sparse_map: SparseMap, problem: Problem) -> float:
    """Largest error of the rotation between neighbours [rad]."""
    rotations = [keyframe.state.rotation for keyframe in sparse_map.keyframes]
    true = problem.states.rotations
    return max(
        float(np.linalg.norm(so3.log((a.T @ b).T @ (c.T @ d))))
        for a, b, c, d in zip(rotations, rotations[1:], true, true[1:], strict=False)
    )


def test_gyro_turns_hold_the_attitude_of_a_map_by_vision() -> None:
    """Velocities and the accelerometer's biases are as before: the motions only turn."""
    problem = bundle_problems.make(10, 40, 15)
    by_vision, by_both = map_of(problem), map_of(problem)
    for sparse_map, turns in ((by_vision, False), (by_both, True)):
        shaken(sparse_map, range(1, 10))
        adjuster = adjuster_of(sparse_map, problem)
        adjuster.turns = turns
        adjuster.adjust_all(False)
    assert turned(by_both, problem) < 0.5 * turned(by_vision, problem)
    for k, keyframe in enumerate(by_both.keyframes):
        np.testing.assert_array_equal(keyframe.state.velocity, problem.states.velocities[k])
        np.testing.assert_array_equal(
            keyframe.state.accelerometer_bias, problem.states.accelerometer_biases[k]
        )


def test_one_keyframe_alone_is_left_as_it_is() -> None:
    problem = bundle_problems.make(1, 100, 50, inertial=False)
    sparse_map = map_of(problem)
    assert adjuster_of(sparse_map, problem).adjust_window(False) is None
    assert errors(sparse_map, problem).max() == 0.0


@pytest.mark.parametrize("inertial", [False, True])
def test_a_shaken_window_comes_back_and_what_holds_it_stays(inertial: bool) -> None:
    problem = bundle_problems.make(10, 400, 120)
    sparse_map = map_of(problem)
    shaken(sparse_map, [6, 7, 8, 9])
    assert errors(sparse_map, problem)[6:].min() > 0.006
    covariance = adjuster_of(sparse_map, problem).adjust_window(inertial)
    off = errors(sparse_map, problem)
    assert off[:6].max() == 0.0
    assert off[6:].max() < 0.006
    assert covariance is not None
    error = sparse_map.keyframes[9].state.position - problem.states.positions[9]
    assert error @ np.linalg.solve(covariance[:3, :3], error) < 16.3  # 99.9 %


def test_the_whole_map_turns_about_the_newest_camera_with_an_imu_and_about_the_start_without() -> (
    None
):
    problem = bundle_problems.make(6, 300, 100, depth=True)
    for inertial, held in [(True, 5), (False, 0)]:
        sparse_map = map_of(problem)
        shaken(sparse_map, [k for k in range(6) if k != held])
        before = sparse_map.keyframes[held].state
        adjuster_of(sparse_map, problem).adjust_all(inertial)
        after = sparse_map.keyframes[held].state
        places = [(state.pose() @ T_RIG_CAMERA).translation for state in (before, after)]
        np.testing.assert_allclose(places[1], places[0], atol=1e-12)
        turn = SE3(before.rotation.T @ after.rotation, np.zeros(3))
        assert abs(turn.heading()) < 5e-3
        if not inertial:
            assert turn.angle() < 1e-9
        assert errors(sparse_map, problem).max() < 0.012


def test_bad_observations_go_and_points_with_too_few_left_leave_the_map() -> None:
    problem = bundle_problems.make(6, 300, 150)
    sparse_map = map_of(problem)
    newest = sparse_map.keyframes[5]
    views = np.bincount(np.concatenate([k.ids for k in sparse_map.keyframes]), minlength=300)
    often = newest.ids[views[newest.ids] >= 4]
    spoiled, alone, clean = often[:10], often[10:15], often[15:]
    newest.pixels[np.isin(newest.ids, spoiled)] += 25.0
    for keyframe in sparse_map.keyframes[:5]:
        keyframe.forget(np.isin(keyframe.ids, alone))
    adjuster_of(sparse_map, problem).adjust_all(False)
    assert not np.isin(newest.ids, spoiled).any()
    assert sparse_map.mapped(spoiled).mean() > 0.5  # a wrong sight bends some beyond repair
    assert not sparse_map.mapped(alone).any()
    assert np.isin(clean, newest.ids).mean() > 0.95
    assert sparse_map.mapped(clean).all()


def test_a_point_that_only_others_saw_often_stays_as_it_is() -> None:
    """One new sight of an old point says nothing yet, but the point is as good as before."""
    problem = bundle_problems.make(10, 400, 120)
    sparse_map = map_of(problem)
    views = np.bincount(np.concatenate([k.ids for k in sparse_map.keyframes]), minlength=400)
    early = np.bincount(np.concatenate([k.ids for k in sparse_map.keyframes[:2]]), minlength=400)
    newest = sparse_map.keyframes[9]
    old = np.setdiff1d(np.flatnonzero((early == 2) & (views <= 4)), newest.ids)[:8]
    assert len(old) > 3
    for keyframe in sparse_map.keyframes[2:]:
        keyframe.forget(np.isin(keyframe.ids, old))
    pose = newest.state.pose() @ T_RIG_CAMERA
    there = CAMERA.project(pose.inverse() @ sparse_map.positions[old])
    newest.see(old, there, np.full(len(old), np.nan))
    before = sparse_map.positions[old].copy()
    adjuster_of(sparse_map, problem).adjust_window(False)  # neither 0 nor 1 holds the window
    assert sparse_map.mapped(old).all()
    np.testing.assert_array_equal(sparse_map.positions[old], before)
    assert np.isin(old, newest.ids).all()


def test_motion_across_a_missing_keyframe_does_not_count() -> None:
    """Factors join neighbours only: `motions` of a keyframe whose predecessor holds not."""
    problem = bundle_problems.make(8, 300, 100)
    sparse_map = map_of(problem)
    adjuster = adjuster_of(sparse_map, problem)
    del adjuster.motions[6]  # samples were missing there
    seen: list[list[tuple[int, int]]] = []
    adjust = map_adjustment.adjust

    def spy(*args: object) -> Adjustment:
        factors: Sequence[InertialFactor] = args[4]  # type: ignore[assignment]
        seen.append([(f.first, f.second) for f in factors])
        return adjust(*args)  # type: ignore[arg-type]

    map_adjustment.adjust = spy  # type: ignore[assignment]
    try:
        adjuster.adjust_window(True)
    finally:
        map_adjustment.adjust = adjust
    [pairs] = seen
    # Chosen: three that hold, the last of them keyframe 3, and 4 to 7 that move.
    assert (2, 3) in pairs
    assert (4, 5) not in pairs
    assert (5, 6) in pairs


def test_motions_around_a_skipped_keyframe_are_joined() -> None:
    problem = bundle_problems.make(5, 200, 80)
    sparse_map = map_of(problem)
    adjuster = adjuster_of(sparse_map, problem)
    motions = dict(adjuster.motions)
    assert adjuster.can_skip(2)
    adjuster.skip(2, inertial=True)
    sparse_map.cull(2)
    assert sorted(adjuster.motions) == [1, 2, 3]
    assert adjuster.motions[1] is motions[1]
    assert adjuster.motions[3] is motions[4]
    both = motions[2].duration_s + motions[3].duration_s
    assert adjuster.motions[2].duration_s == pytest.approx(both)
    assert not any(keyframe.held for keyframe in sparse_map.keyframes)
    # The joined motion leads where the two led.
    first, last = (sparse_map.keyframes[k].state for k in (1, 2))
    _, position, _ = adjuster.motions[2].predict(
        first.rotation, first.position, first.velocity, first.gyro_bias, first.accelerometer_bias
    )
    np.testing.assert_allclose(position, last.position, atol=0.02)


def test_a_motion_that_would_grow_too_long_goes_only_when_settled(
    monkeypatch: pytest.MonkeyPatch, chosen: list
) -> None:
    problem = bundle_problems.make(6, 200, 80)
    sparse_map = map_of(problem)
    adjuster = adjuster_of(sparse_map, problem)
    monkeypatch.setattr(map_adjustment, "MAX_JOINED_S", 1.5 * adjuster.motions[2].duration_s)
    assert not adjuster.can_skip(2)
    # Adjusting the whole map long after they were made settles keyframes 0 to 3.
    monkeypatch.setattr(map_adjustment, "SETTLING_NS", 2)
    adjuster.adjust_all(True)
    assert [adjuster.can_skip(k) for k in range(1, 5)] == [True, True, False, False]
    adjuster.skip(2, inertial=True)
    sparse_map.cull(2)
    assert [keyframe.held for keyframe in sparse_map.keyframes] == [False, True, True, False, False]
    assert sorted(adjuster.motions) == [1, 3, 4]
    before = [keyframe.state.position for keyframe in sparse_map.keyframes]
    shaken(sparse_map, [0, 3, 4])
    adjuster.adjust_all(True)
    assert chosen[-1][1] == [Role.FREE, Role.FIXED, Role.FIXED, Role.FREE, Role.FREE]
    after = [keyframe.state.position for keyframe in sparse_map.keyframes]
    np.testing.assert_array_equal(after[1:3], before[1:3])
    np.testing.assert_allclose(after, before, atol=0.01)


def test_where_inertia_does_not_count_no_keyframe_is_held() -> None:
    problem = bundle_problems.make(5, 200, 80)
    sparse_map = map_of(problem)
    adjuster = adjuster_of(sparse_map, problem)
    del adjuster.motions[2]
    assert not adjuster.can_skip(2)
    adjuster.skip(2, inertial=False)
    sparse_map.cull(2)
    assert sorted(adjuster.motions) == [1, 3]
    assert not any(keyframe.held for keyframe in sparse_map.keyframes)


def test_the_whole_map_is_adjusted_less_and_less_often_but_never_seldom() -> None:
    problem = bundle_problems.make(2, 100, 50)
    sparse_map = map_of(problem)
    adjuster = adjuster_of(sparse_map, problem)
    due = []
    for made in range(2, 2000):
        sparse_map.culled = made - 2  # all but two were culled: made counts
        if adjuster.all_due():
            due.append(made)
    assert due[0] == map_adjustment.FIRST_ALL
    steps = np.diff(due)
    assert (np.diff(steps) >= 0).all()
    assert steps[-1] == map_adjustment.MOST_BETWEEN_ALL

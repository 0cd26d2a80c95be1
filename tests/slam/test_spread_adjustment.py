"""The whole map adjusted in pieces: as good as at once, while the map goes on growing."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from airground.config import Config, MonocularSlam
from airground.core.messages import GroundImage, RobotCalibration
from airground.core.se3 import SE3
from airground.slam import so3, spread_adjustment, warm_up
from airground.slam.bundle_adjustment import Settings, adjust, adjusting
from airground.slam.bundle_adjustment.solver import completed
from airground.slam.feature_tracker import FeatureTracker
from airground.slam.keyframe_slam import KeyframeSlam
from airground.slam.loop_closure import LoopCloser
from airground.slam.map_adjustment import SETTLING_NS
from airground.slam.recovery import Recovery
from airground.slam.rgbd import RgbdSlam
from airground.slam.sparse_map import CANDIDATE, DROPPED, Keyframe, SparseMap
from airground.slam.spread_adjustment import SpreadAdjustment, WholeMap
from tests.slam import bundle_problems
from tests.slam.bundle_problems import CAMERA, NOISE, T_RIG_CAMERA, Problem
from tests.slam.test_map_adjustment import adjuster_of, errors, map_of

BEND = np.array([0.0, 0.0, 0.006])
"""Turn from keyframe to keyframe [rad]: after ten of them the map is bent by 3.4 deg."""


def bent(problem: Problem, sharply: bool = False) -> SparseMap:
    """The map of a problem, each keyframe and what it saw first turned a little more."""
    sparse_map = map_of(problem)
    by = [SE3(so3.exp(k * BEND), [0, 0, 0.002 * k]) for k in range(len(problem.states))]
    first = np.zeros(len(problem.points), np.int64)
    seen = problem.observations
    np.minimum.at(first, seen.points, 0)
    for k in reversed(range(len(by))):
        first[seen.points[seen.keyframes == k]] = k
    sparse_map.origins[: len(first)] = first
    for k, keyframe in enumerate(sparse_map.keyframes):
        keyframe.state = keyframe.state.moved(by[k])
        own = np.flatnonzero(first == k)
        sparse_map.positions[own] = by[k] @ sparse_map.positions[own]
    return sparse_map


def bend_m(sparse_map: SparseMap, problem: Problem) -> float:
    """Error of the way from the newest keyframe back to the first, in the newest one's axes [m]."""
    first, newest = (sparse_map.keyframes[n].state for n in (0, -1))
    true = problem.states
    way = newest.rotation.T @ (first.position - newest.position)
    true_way = true.rotations[-1].T @ (true.positions[0] - true.positions[-1])
    return float(np.linalg.norm(way - true_way))


def finish(work: SpreadAdjustment) -> int:
    pieces = 1
    while not work.go_on():
        pieces += 1
    return pieces


def whole_map(sparse_map: SparseMap, problem: Problem) -> WholeMap:
    adjuster, own = adjuster_of(sparse_map, problem), (CAMERA, T_RIG_CAMERA, MonocularSlam())
    recovery, tracker = Recovery(sparse_map, *own), FeatureTracker(own[2].patch_px, 1)
    return WholeMap(sparse_map, adjuster, LoopCloser(sparse_map, tracker, adjuster, recovery, *own))


@pytest.mark.parametrize("inertial", [False, True])
def test_a_bent_map_becomes_straight_at_once_and_in_pieces_alike(inertial: bool) -> None:
    problem = bundle_problems.make(10, 400, 120, depth=True)
    at_once, spread = bent(problem), bent(problem)
    assert bend_m(spread, problem) > 0.03
    adjuster_of(at_once, problem).adjust_all(inertial)
    assert finish(SpreadAdjustment(spread, adjuster_of(spread, problem), inertial)) > 10
    assert bend_m(at_once, problem) < 0.01
    assert bend_m(spread, problem) < 0.01
    for one, two in zip(at_once.keyframes, spread.keyframes, strict=True):
        for name in ("rotation", "position", "velocity", "gyro_bias", "accelerometer_bias"):
            if name == "velocity" and not inertial:
                continue  # Vision says nothing of it; in pieces it turns with its keyframe.
            np.testing.assert_allclose(
                getattr(two.state, name), getattr(one.state, name), atol=1e-9
            )
        np.testing.assert_array_equal(two.ids, one.ids)
    np.testing.assert_array_equal(spread.states, at_once.states)
    twice = np.flatnonzero(np.bincount(np.concatenate([k.ids for k in spread.keyframes])) >= 2)
    assert len(twice) > 200
    np.testing.assert_allclose(spread.positions[twice], at_once.positions[twice], atol=1e-9)


def test_pauses_change_no_bit() -> None:
    problem = bundle_problems.make(8, 300, 100)
    roles = bundle_problems.fixed(problem.states, 2)
    states, points = bundle_problems.perturbed(problem, roles)
    parts = (
        *(states, roles, points, problem.observations, problem.inertial),
        *(CAMERA, T_RIG_CAMERA, Settings()),
    )
    whole, pieces = adjust(*parts), adjusting(*parts)
    paused = sum(1 for _ in zip(range(7), pieces, strict=False))
    rest = completed(pieces)
    assert paused == 7
    assert rest.iterations == whole.iterations > 2
    np.testing.assert_array_equal(rest.states.positions, whole.states.positions)
    np.testing.assert_array_equal(rest.points, whole.points)
    np.testing.assert_array_equal(rest.covariance, whole.covariance)


def grown(sparse_map: SparseMap) -> tuple[Keyframe, np.ndarray]:
    """A new keyframe, 0.2 m from the newest one, and points that it saw first."""
    newest = sparse_map.keyframes[-1].state
    rng = np.random.default_rng(5)
    state = newest.moved(SE3.from_rotation_vector((0.02, 0.01, 0.1), (0.2, 0.0, 0.01)))
    ids = sparse_map.new_points(np.zeros((30, 2)), len(sparse_map.keyframes))
    sparse_map.place(ids, state.position + rng.uniform(-0.5, 0.5, (30, 3)) - [0, 0, 2])
    pixels = rng.uniform(0, 400, (30, 2))
    stamp_ns = sparse_map.keyframes[-1].stamp_ns + 1
    image = np.zeros((4, 4), np.uint8)
    keyframe = Keyframe(stamp_ns, image, state, ids, pixels, np.full(30, np.nan))
    sparse_map.keyframes.append(keyframe)
    return keyframe, ids


@pytest.mark.parametrize("inertial", [False, True])
def test_what_came_meanwhile_keeps_its_place_beside_the_newest(inertial: bool) -> None:
    problem = bundle_problems.make(10, 400, 120, depth=True)
    sparse_map = bent(problem)
    work = SpreadAdjustment(sparse_map, adjuster_of(sparse_map, problem), inertial)
    assert not work.go_on()
    newest, (keyframe, ids) = sparse_map.keyframes[-1], grown(sparse_map)
    back = newest.state.pose().inverse()
    before = back @ keyframe.state.pose(), back @ sparse_map.positions[ids]
    speed, here = newest.state.rotation.T @ keyframe.state.velocity, newest.state.position
    finish(work)
    back = newest.state.pose().inverse()
    after = back @ keyframe.state.pose(), back @ sparse_map.positions[ids]
    # The bend had set the newest view's points a little too far away: all comes nearer.
    scale = np.ptp(after[1]) / np.ptp(before[1])
    assert 0.97 < scale < 1.0
    np.testing.assert_allclose(after[0].rotation, before[0].rotation, atol=1e-9)
    np.testing.assert_allclose(after[0].translation, scale * before[0].translation, atol=1e-3)
    np.testing.assert_allclose(after[1], scale * before[1], atol=1e-9)
    turned = newest.state.rotation.T @ keyframe.state.velocity
    np.testing.assert_allclose(turned, scale * speed, atol=1e-9)
    assert inertial or np.linalg.norm(newest.state.position - here) > 0.05, "nothing moved"


def test_where_the_scale_is_open_what_came_meanwhile_follows_it() -> None:
    """By vision alone a map may shrink: keyframes and points that are new shrink with it."""
    problem = bundle_problems.make(10, 400, 120, inertial=False)
    sparse_map = map_of(problem)
    work = SpreadAdjustment(sparse_map, adjuster_of(sparse_map, problem), False)
    result = completed(work._pieces)
    arms = result.states.rotations @ T_RIG_CAMERA.translation
    centres = result.states.positions + arms
    shrunk = replace(result.states, positions=0.8 * centres - arms)
    newest, (keyframe, ids) = sparse_map.keyframes[-1], grown(sparse_map)

    def around() -> tuple[np.ndarray, np.ndarray]:
        centre = (keyframe.state.pose() @ T_RIG_CAMERA).translation
        return centre - newest.state.position, sparse_map.positions[ids] - newest.state.position

    before = around()
    work._move_map(replace(result, states=shrunk, points=0.8 * result.points))
    for one, two in zip(before, around(), strict=True):
        np.testing.assert_allclose(two, 0.8 * one, atol=0.015)
        assert np.linalg.norm(two) == pytest.approx(0.8 * np.linalg.norm(one), rel=0.01)


def test_what_went_meanwhile_stays_away_and_what_moved_meanwhile_moves_on() -> None:
    problem = bundle_problems.make(10, 400, 120, depth=True)
    at_once, spread = bent(problem), bent(problem)
    adjuster_of(at_once, problem).adjust_all(False)
    work = SpreadAdjustment(spread, adjuster_of(spread, problem), False)
    work.go_on()
    spread.drop(np.array([3]))
    culled, shifted = spread.keyframes[4], spread.keyframes[9]
    gone = culled.state
    spread.cull(4)
    by = np.array([0.001, 0.0, -0.001])
    shifted.state = shifted.state.shifted(by)
    finish(work)
    assert culled.state is gone
    assert spread.states[3] == DROPPED
    assert len(spread.keyframes) == 9
    others = [k for n, k in enumerate(at_once.keyframes) if n not in (4, 9)]
    kept = [k for k in spread.keyframes if k is not shifted]
    for one, two in zip(others, kept, strict=True):
        np.testing.assert_allclose(two.state.position, one.state.position, atol=1e-9)
    moved = shifted.state.position - at_once.keyframes[9].state.position
    assert np.linalg.norm(moved) == pytest.approx(np.linalg.norm(by), rel=1e-6)


def test_sights_that_do_not_fit_go_and_new_ones_stay() -> None:
    problem = bundle_problems.make(6, 300, 150)
    sparse_map = map_of(problem)
    newest = sparse_map.keyframes[5]
    views = np.bincount(np.concatenate([k.ids for k in sparse_map.keyframes]), minlength=300)
    spoiled = newest.ids[views[newest.ids] >= 4][:10]
    newest.pixels[np.isin(newest.ids, spoiled)] += 25.0
    work = SpreadAdjustment(sparse_map, adjuster_of(sparse_map, problem), False)
    work.go_on()
    new = sparse_map.new_points(np.zeros((5, 2)), 5)
    newest.see(new, np.zeros((5, 2)), np.full(5, np.nan))
    finish(work)
    assert not np.isin(newest.ids, spoiled).any()
    assert np.isin(new, newest.ids).all()
    assert (sparse_map.states[new] == CANDIDATE).all()


def test_keyframes_settle_when_the_work_is_done_and_as_it_began() -> None:
    problem = bundle_problems.make(6, 300, 150)
    sparse_map = map_of(problem)
    adjuster = adjuster_of(sparse_map, problem)
    before, newest = adjuster.settled_ns, sparse_map.keyframes[-1].stamp_ns
    work = SpreadAdjustment(sparse_map, adjuster, True)
    work.go_on()
    grown(sparse_map)
    assert adjuster.settled_ns == before
    finish(work)
    assert adjuster.settled_ns == newest - SETTLING_NS


def test_a_small_map_is_adjusted_at_once_and_a_large_one_later(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    problem = bundle_problems.make(6, 300, 100, depth=True)
    for most, at_once in ((6, True), (5, False)):
        monkeypatch.setattr(spread_adjustment, "MOST_AT_ONCE", most)
        sparse_map = bent(problem)
        whole = whole_map(sparse_map, problem)
        assert not whole.go_on(False), "nothing was begun"
        states = [keyframe.state for keyframe in sparse_map.keyframes]
        assert whole.begin(False) == at_once
        changed = [k.state is not s for k, s in zip(sparse_map.keyframes, states, strict=True)]
        assert all(changed) == any(changed) == at_once
        done = [whole.go_on(False) for _ in range(200)]
        assert sum(done) == (not at_once)
        assert bend_m(sparse_map, problem) < 0.01


def test_work_under_way_is_dropped_or_begins_anew(monkeypatch: pytest.MonkeyPatch) -> None:
    problem = bundle_problems.make(6, 300, 100, depth=True)
    monkeypatch.setattr(spread_adjustment, "MOST_AT_ONCE", 0)
    pieces = {}
    for name in ("undisturbed", "asked again", "moved", "at once"):
        sparse_map = bent(problem)
        whole = whole_map(sparse_map, problem)
        whole.begin(False)
        for _ in range(5):
            assert not whole.go_on(False)
        if name == "asked again":
            whole.begin(False)
        elif name == "moved":
            whole.begin_anew()
        elif name == "at once":
            assert whole.at_once(False)
        done = [whole.go_on(False) for _ in range(200)]
        pieces[name] = done.index(True) if any(done) else None
        assert errors(sparse_map, problem).max() < 0.02
    assert pieces["undisturbed"] == pieces["asked again"]
    assert pieces["moved"] == pieces["undisturbed"] + 5
    assert pieces["at once"] is None


def engine_with_work(monkeypatch: pytest.MonkeyPatch) -> KeyframeSlam:
    monkeypatch.setattr(spread_adjustment, "MOST_AT_ONCE", 0)
    problem = bundle_problems.make(6, 300, 100, inertial=False)
    calibration = RobotCalibration(CAMERA, T_RIG_CAMERA, SE3.identity(), NOISE)
    slam = KeyframeSlam(calibration, MonocularSlam(), np.random.default_rng(0))
    made = map_of(problem)
    for name, value in vars(made).items():
        setattr(slam.map, name, value)
    slam.state = slam.map.keyframes[-1].state
    assert slam.adjust_all(at_once=False), "until scale and vertical are known nothing waits"
    slam.settled, slam.moved_from = True, None
    assert not slam.adjust_all(at_once=False)
    assert not slam._whole.go_on(False)
    assert slam._whole._work is not None
    return slam


def test_the_engine_drops_it_with_the_map_and_begins_anew_in_a_moved_one(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    slam = engine_with_work(monkeypatch)
    slam.move(1.1, np.eye(3))
    assert slam._whole._work is None
    assert slam._whole._due
    assert slam.adjust_all()  # as `finish` does
    assert not slam._whole._due
    slam = engine_with_work(monkeypatch)
    slam.reset()
    assert not slam._whole._due
    assert slam._whole._work is None
    assert slam._whole.map is slam.map


def test_the_engine_goes_on_from_where_the_newest_keyframe_is_then(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    slam = engine_with_work(monkeypatch)
    keyframe, _ = grown(slam.map)
    slam.state = replace(keyframe.state, position=keyframe.state.position + 0.01)
    there, here = keyframe.state.pose().inverse() @ slam.state.pose(), slam.T_map_camera()
    while not slam._follow(slam._whole.go_on):
        assert slam.moved_from is None
    np.testing.assert_array_equal(slam.moved_from.matrix(), here.matrix())
    assert np.abs(slam.T_map_camera().matrix() - here.matrix()).max() > 1e-5, "nothing moved"
    after = keyframe.state.pose().inverse() @ slam.state.pose()
    np.testing.assert_allclose(after.matrix(), there.matrix(), atol=1e-9)


def test_an_image_that_makes_no_keyframe_reports_the_correction(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The whole front end, over images of a floor that the camera swings over."""
    monkeypatch.setattr(spread_adjustment, "MOST_AT_ONCE", 0)
    rng = np.random.default_rng(0)
    texture, slam = warm_up._texture(rng), RgbdSlam(warm_up._calibration(), Config(), rng)
    depth = np.full((warm_up.CAMERA.height, warm_up.CAMERA.width), warm_up.HEIGHT_M, np.float32)
    corrected = []
    for index in range(1, warm_up.DARK[0]):
        colour = np.repeat(warm_up._image(texture, index)[..., None], 3, axis=2)
        stamp_ns = index * warm_up.IMAGE_NS
        slam.add_imu(warm_up._samples(stamp_ns))
        made = slam._slam.map.made
        pose = slam.track(GroundImage(stamp_ns, colour, depth))
        if index == 40:
            assert not slam._slam.adjust_all(at_once=False)
        if pose.corrected and index > 40:
            corrected.append((index, slam._slam.map.made > made))
    assert corrected
    assert not any(at_keyframe for _, at_keyframe in corrected)

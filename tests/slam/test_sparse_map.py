"""The sparse map: its motions compose, keep what cameras see, and its points grow in number."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from airground.core.se3 import SE3
from airground.slam import so3
from airground.slam.inertial.preintegration import GRAVITY
from airground.slam.inertial.stationarity import Rest
from airground.slam.rig_state import RigState
from airground.slam.sparse_map import CANDIDATE, DROPPED, FIRST_POINTS, Keyframe, SparseMap
from tests.slam.views import CAMERA

LEVER = np.array([0.05, -0.02, -0.03])
T_RIG_CAMERA = SE3.from_rotation_vector((3.0, 0.1, 0.2), LEVER)


def keyframe(ids: list[int], state: RigState | None = None) -> Keyframe:
    image = np.zeros((4, 4), np.uint8)
    pixels = np.column_stack([ids, np.zeros(len(ids))]).astype(float)
    depths = np.full(len(ids), np.nan)
    numbers = np.array(ids, np.int64)
    return Keyframe(0, image, state or RigState.at_origin(), numbers, pixels, depths)


def some_map(seed: int = 0) -> SparseMap:
    rng = np.random.default_rng(seed)
    sparse_map = SparseMap()
    for _ in range(3):
        state = RigState.at_origin().posed(
            SE3.from_rotation_vector(rng.normal(size=3), rng.normal(size=3))
        )
        sparse_map.keyframes.append(keyframe([], state))
    ids = sparse_map.new_points(rng.uniform(0, 400, (50, 2)), 0)
    sparse_map.place(ids, rng.normal(0, 3, (50, 3)))
    return sparse_map


def views(sparse_map: SparseMap) -> np.ndarray:
    """(K, n, 2) pixels of all points in all keyframes."""
    points = sparse_map.positions[: len(sparse_map)]
    poses = [k.state.pose() @ T_RIG_CAMERA for k in sparse_map.keyframes]
    return np.array([CAMERA.project(pose.inverse() @ points) for pose in poses])


def centres(sparse_map: SparseMap) -> np.ndarray:
    return np.array([(k.state.pose() @ T_RIG_CAMERA).translation for k in sparse_map.keyframes])


VECTORS = st.tuples(*[st.floats(-2, 2)] * 3).map(np.array)
SCALES = st.floats(0.2, 5.0)


@settings(deadline=None, max_examples=30)
@given(SCALES, VECTORS)
def test_moving_the_map_changes_no_image_of_it(scale: float, turn: np.ndarray) -> None:
    sparse_map = some_map()
    before, cameras = views(sparse_map), centres(sparse_map)
    R = so3.exp(turn)
    sparse_map.move(scale, R, LEVER)
    np.testing.assert_allclose(views(sparse_map), before, atol=1e-5, rtol=1e-6)
    np.testing.assert_allclose(centres(sparse_map), scale * cameras @ R.T, atol=1e-9)
    for moved, old in zip(sparse_map.keyframes, some_map().keyframes, strict=True):
        # The rig stays as far from its camera as it is.
        arm = moved.state.rotation @ T_RIG_CAMERA.translation
        assert np.linalg.norm(arm) == pytest.approx(np.linalg.norm(LEVER))
        np.testing.assert_allclose(moved.state.rotation, R @ old.state.rotation, atol=1e-12)


@settings(deadline=None, max_examples=30)
@given(SCALES, VECTORS, SCALES, VECTORS)
def test_two_moves_are_one(s1: float, v1: np.ndarray, s2: float, v2: np.ndarray) -> None:
    stepwise, at_once = some_map(), some_map()
    stepwise.move(s1, so3.exp(v1), LEVER)
    stepwise.move(s2, so3.exp(v2), LEVER)
    at_once.move(s1 * s2, so3.exp(v2) @ so3.exp(v1), LEVER)
    np.testing.assert_allclose(stepwise.positions, at_once.positions, atol=1e-9)
    for a, b in zip(stepwise.keyframes, at_once.keyframes, strict=True):
        np.testing.assert_allclose(a.state.position, b.state.position, atol=1e-9)
        np.testing.assert_allclose(a.state.rotation, b.state.rotation, atol=1e-9)


def test_points_keep_what_is_known_of_them_as_their_number_outgrows_the_arrays() -> None:
    sparse_map = SparseMap()
    rng = np.random.default_rng(1)
    pixels = [rng.uniform(0, 400, (n, 2)) for n in (10, FIRST_POINTS, 3, 2 * FIRST_POINTS + 1)]
    ids = [sparse_map.new_points(p, origin) for origin, p in enumerate(pixels)]
    sparse_map.place(ids[0], np.full((10, 3), 7.0))
    assert len(sparse_map) == sum(map(len, pixels))
    np.testing.assert_array_equal(np.concatenate(ids), np.arange(len(sparse_map)))
    for origin, (numbers, first) in enumerate(zip(ids, pixels, strict=True)):
        np.testing.assert_array_equal(sparse_map.first_pixels[numbers], first)
        assert (sparse_map.origins[numbers] == origin).all()
    assert sparse_map.mapped(ids[0]).all()
    assert (sparse_map.states[np.concatenate(ids[1:])] == CANDIDATE).all()
    assert (sparse_map.positions[ids[0]] == 7.0).all()


def test_only_points_in_the_map_are_seen_and_shared_counts_those_asked_for() -> None:
    sparse_map = SparseMap()
    ids = sparse_map.new_points(np.zeros((6, 2)), 0)
    sparse_map.place(ids[:4], np.zeros((4, 3)))  # 4 and 5 stay candidates
    sparse_map.drop(ids[1:2])
    sparse_map.keyframes = [keyframe([3, 1, 0]), keyframe([2, 3, 4]), keyframe([5])]
    assert sparse_map.seen_by([0, 1]).tolist() == [0, 2, 3]
    assert sparse_map.seen_by([2]).tolist() == sparse_map.seen_by([]).tolist() == []
    assert sparse_map.shared(np.array([0, 2, 3])).tolist() == [2, 2, 0]
    assert sparse_map.shared(np.empty(0, np.int64)).tolist() == [0, 0, 0]


def test_a_keyframe_forgets_and_sees_whole_observations() -> None:
    frame = keyframe([4, 8, 6])
    frame.forget(np.array([False, True, False]))
    frame.see(np.array([9]), np.array([[9.0, 0.0]]), np.array([0.5]))
    assert frame.ids.tolist() == frame.pixels[:, 0].tolist() == [4, 6, 9]
    np.testing.assert_array_equal(frame.inverse_depths, [np.nan, np.nan, 0.5])


def test_who_stood_has_no_velocity_and_all_have_the_biases_seen_then() -> None:
    rest = Rest(np.array([0.01, -0.02, 0.03]), np.array([0.0, 0.6, 0.8]) * (GRAVITY + 0.1))
    sparse_map = some_map()
    for n, one in enumerate(sparse_map.keyframes):
        one.stamp_ns = 10 * n
        one.state = replace(one.state, velocity=np.array([0.3, 0.0, 0.1]))
    poses = [one.state.pose().matrix() for one in sparse_map.keyframes]
    sparse_map.stand_still(20, rest)
    assert [one.still for one in sparse_map.keyframes] == [False, False, True]
    for one, pose in zip(sparse_map.keyframes, poses, strict=True):
        speed = [0, 0, 0] if one.still else [0.3, 0.0, 0.1]
        np.testing.assert_array_equal(one.state.velocity, speed)
        np.testing.assert_array_equal(one.state.gyro_bias, rest.gyro)
        np.testing.assert_allclose(one.state.accelerometer_bias, [0, 0.06, 0.08], atol=1e-12)
        np.testing.assert_array_equal(one.state.pose().matrix(), pose)


def culling_map() -> SparseMap:
    """Four keyframes; points 0 to 5 begin in the first, 6 to 9 in the second, and so on."""
    sparse_map = SparseMap()
    seen = [[0, 1, 2, 3, 4, 5], [0, 1, 2, 6, 7, 8, 9], [1, 2, 3, 7, 8, 10], [2, 8, 10, 11]]
    for k, count in enumerate((6, 4, 1, 1)):
        sparse_map.new_points(np.full((count, 2), float(k)), k)
        sparse_map.keyframes.append(keyframe(seen[k]))
    sparse_map.place(np.array([0, 1, 2, 3, 6, 7]), np.ones((6, 3)))
    return sparse_map


def test_a_culled_keyframe_leaves_what_others_saw() -> None:
    sparse_map = culling_map()
    kept = [sparse_map.keyframes[k] for k in (0, 2, 3)]
    sparse_map.cull(1)
    assert sparse_map.keyframes == kept
    assert (sparse_map.culled, sparse_map.made) == (1, 4)
    # Seen by two others, by one, or by none.
    assert sparse_map.mapped(np.array([1, 2, 3])).all()
    assert not sparse_map.mapped(np.array([0, 6, 7])).any()
    # What was not in it is as it was; every origin names a keyframe that was there then.
    assert sparse_map.states[[4, 5, 10, 11]].tolist() == [CANDIDATE] * 4
    assert sparse_map.origins[[0, 4, 10, 11]].tolist() == [0, 0, 1, 2]


def test_candidates_of_a_culled_keyframe_begin_where_they_were_seen_next() -> None:
    sparse_map = culling_map()
    sparse_map.cull(1)
    assert sparse_map.states[8] == CANDIDATE
    assert sparse_map.origins[8] == 1
    np.testing.assert_array_equal(sparse_map.first_pixels[8], [8.0, 0.0])
    assert sparse_map.states[9] == DROPPED  # seen by no other keyframe


class Numbers:
    """Numbers of points beside those of keyframes."""

    def __init__(self, ids: list[int]) -> None:
        self.ids = np.array(ids)

    def held_points(self) -> np.ndarray:
        return self.ids

    def renumber(self, new: np.ndarray) -> None:
        self.ids = new[self.ids]


def test_points_that_nothing_holds_go_from_memory_and_the_others_keep_their_order() -> None:
    sparse_map, rng = SparseMap(), np.random.default_rng(3)
    count = 2 * FIRST_POINTS
    sparse_map.new_points(rng.uniform(0, 400, (count, 2)), 0)
    sparse_map.place(np.arange(0, count, 2), rng.normal(size=(count // 2, 3)))
    seen = [rng.permutation(count)[:700].tolist() for _ in range(3)]
    sparse_map.keyframes += [keyframe(ids) for ids in seen]
    sparse_map.drop(np.array(seen[0][:300]))  # a keyframe may hold points that are out
    other = Numbers([seen[1][5], 4001, 17])
    sparse_map.holders.append(other)
    before = [*seen, other.ids]
    names = ("positions", "states", "origins", "first_pixels")
    expected = [[getattr(sparse_map, name)[ids] for name in names] for ids in before]
    sparse_map.compact()
    after = [*(one.ids for one in sparse_map.keyframes), other.ids]
    for ids, values in zip(after, expected, strict=True):
        for name, value in zip(names, values, strict=True):
            np.testing.assert_array_equal(getattr(sparse_map, name)[ids], value)
    held = np.unique(np.concatenate(before))
    assert len(sparse_map) == len(held) < count
    np.testing.assert_array_equal(
        np.argsort(np.concatenate(before)), np.argsort(np.concatenate(after))
    )
    # What comes next begins as the first points did.
    assert sparse_map.new_points(np.zeros((1, 2)), 2).tolist() == [len(held)]
    assert sparse_map.states[len(held)] == CANDIDATE
    assert len(sparse_map.states) == count


def test_memory_is_bounded_by_what_is_held() -> None:
    sparse_map = SparseMap()
    for _ in range(200):
        ids = sparse_map.new_points(np.zeros((500, 2)), 0)
        sparse_map.keyframes = [keyframe(ids.tolist())]
        sparse_map.compact()
    assert len(sparse_map.states) <= 2 * FIRST_POINTS


def test_points_keep_their_numbers_while_work_holds_them() -> None:
    sparse_map = SparseMap()
    sparse_map.new_points(np.zeros((2 * FIRST_POINTS, 2)), 0)
    sparse_map.keyframes = [keyframe([5])]
    sparse_map.renumbers = False
    sparse_map.compact()
    assert sparse_map.keyframes[0].ids.tolist() == [5]
    sparse_map.renumbers = True
    sparse_map.compact()
    assert sparse_map.keyframes[0].ids.tolist() == [0]

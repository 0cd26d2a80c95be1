"""A ground robot whose map slipped comes back and closes the loop; other places close none."""

from __future__ import annotations

from collections.abc import Callable
from itertools import count, takewhile

import numpy as np
import pytest
from numpy.typing import NDArray

from airground.config import Config
from airground.core.messages import GroundImage
from airground.core.se3 import SE3
from airground.slam import loop_closure, spread_adjustment
from airground.slam.front_end import TrackedPose
from airground.slam.geometry.descriptors import describe
from airground.slam.keyframe_slam import KeyframeSlam
from airground.slam.local_mapping import MIN_REUSED
from airground.slam.recovery import Found
from airground.slam.rgbd import RgbdSlam
from tests.slam.synthetic_world import Sequence, ground_sequence

FRAMES_AROUND, FRAMES_HALF = 100, 58
"""Once around the room and a little more; far enough to have keyframes out of the window."""
SLIP_FRAME = 43
SLIP = SE3.from_heading(np.deg2rad(5.0), (0.25, 0.15, 0.02))
"""About the origin of the map: the robot itself is displaced by 0.3 m."""
NEAR_M = 0.02
"""Drift of the engine alone within the ring is up to 3 cm."""


def half_way() -> Sequence:
    return ground_sequence(FRAMES_HALF, 10.0, 1.0)


def robot(sequence: Sequence) -> tuple[RgbdSlam, KeyframeSlam]:
    config = Config()
    section = config.rgbd_slam.model_copy(update={"max_depth_m": 6.0})
    config = config.model_copy(update={"rgbd_slam": section})
    front_end = RgbdSlam(sequence.calibration, config, np.random.default_rng(0))
    return front_end, front_end._slam


def feed(
    sequence: Sequence,
    front_end: RgbdSlam,
    after: Callable[[int], None] = lambda _: None,
) -> list[TrackedPose]:
    """Every image through the front end; `after` is called with the number of each."""
    tracked, previous = [], np.iinfo(np.int64).min
    for index, image in enumerate(sequence.images):
        assert isinstance(image, GroundImage)
        front_end.add_imu(sequence.imu.between(previous, image.stamp_ns))
        tracked.append(front_end.track(image))
        previous = image.stamp_ns
        after(index)
    return tracked


def slip(slam: KeyframeSlam) -> None:
    """From its newest keyframe on, the robot believes to be elsewhere.

    What it follows gets new numbers at displaced positions, as if found anew after a moment
    in which the robot did not know how it moved.
    """
    sparse_map, newest = slam.map, slam.map.keyframes[-1]
    newest.forget(~sparse_map.mapped(newest.ids))
    copies = sparse_map.new_points(newest.pixels, len(sparse_map.keyframes) - 1)
    sparse_map.place(copies, SLIP @ sparse_map.positions[newest.ids])
    number = np.full(len(sparse_map), -1)
    number[newest.ids] = copies
    slam.tracker.keep(number[slam.tracker.ids] >= 0)
    slam.tracker.ids = number[slam.tracker.ids]
    newest.ids = copies
    newest.state, slam.state = newest.state.moved(SLIP), slam.state.moved(SLIP)


def off_m(sequence: Sequence, tracked: list[TrackedPose]) -> NDArray[np.float64]:
    """(N,) distance of live poses to the truth, the first one's frame taken over [m]."""
    poses = [pose.T_map_camera for pose in tracked]
    assert poses[0] is not None
    T_world_map = sequence.T_world_camera[0] @ poses[0].inverse()
    distances = [
        np.nan if T is None else np.linalg.norm((T_world_map @ T).translation - truth)
        for T, truth in zip(poses, sequence.T_world_camera.translations, strict=True)
    ]
    return np.array(distances)


@pytest.mark.slow
@pytest.mark.parametrize("large", [False, True], ids=["at once", "spread over images"])
def test_a_map_that_slipped_is_straightened_when_the_robot_returns(
    large: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    if large:
        monkeypatch.setattr(loop_closure, "MOST_AT_ONCE", 0)
        monkeypatch.setattr(spread_adjustment, "MOST_AT_ONCE", 0)
    sequence = ground_sequence(FRAMES_AROUND, 10.0, 1.0)
    front_end, slam = robot(sequence)
    slipped: list[int] = []

    def after(index: int) -> None:
        if index == SLIP_FRAME:
            slip(slam)
            slipped.append(slam.map.keyframes[-1].stamp_ns)
            # Nothing but a closed loop leads back to old points.
            slam._mapper._reuse = lambda *_: False  # type: ignore[method-assign]

    def go_on() -> bool:
        closed = piece()
        if closed:
            slam._mapper._reuse = reuse  # type: ignore[method-assign]
        return closed

    reuse, piece = slam._mapper._reuse, slam._loops.go_on
    slam._loops.go_on = go_on  # type: ignore[method-assign]

    tracked = feed(sequence, front_end, after)
    off = off_m(sequence, tracked)
    assert np.nanmin(off[SLIP_FRAME + 1 : SLIP_FRAME + 20]) > 0.2, "it did not slip"
    assert off[-1] < NEAR_M
    closed = int(np.flatnonzero(off > 0.2)[-1]) + 1
    assert tracked[closed].corrected
    newest = slam.map.keyframes[-1].ids
    first_slipped = [k.stamp_ns >= slipped[0] for k in slam.map.keyframes].index(True)
    old = (slam.map.origins[newest] < first_slipped).sum()
    assert old >= MIN_REUSED, "old points are followed again"
    assert len(np.unique(newest)) == len(newest)
    assert len(np.unique(slam.tracker.ids)) == len(slam.tracker.ids)
    path = front_end.trajectory()
    assert path is not None
    T_world_map = sequence.T_world_camera[0] @ path[0].inverse()
    truth = np.array([sequence.T_world_camera.at(int(t)).translation for t in path.stamps_ns])
    final = np.linalg.norm(T_world_map @ path.translations - truth, axis=1)
    assert final.max() < 0.08
    assert np.sqrt(np.mean(final**2)) < 0.03


class Twin:
    """A robot half way around the room, in front of what looks like its beginning."""

    def __init__(self) -> None:
        sequence = half_way()
        front_end, self.slam = robot(sequence)
        feed(sequence, front_end)
        keyframes = self.slam.map.keyframes
        assert len(keyframes) > self.slam.parameters.window + 4
        first, newest = keyframes[0], keyframes[-1]
        newest.image = first.image
        index, number = self.slam._recovery._index, newest.stamp_ns
        # What it followed stays; only its looks are those of the first keyframe.
        index.add(number, first.image, newest.ids, newest.pixels)
        index._descriptors[number] = describe(first.image, first.pixels).descriptors
        self.before = loop_closure.MapSnapshot.of(self.slam.map)
        self.followed = self.slam.tracker.ids.copy()

    def close(self, depth: bool = True) -> bool:
        """Whether the newest keyframe, once all pieces are done, closes a loop."""
        loops = self.slam._loops
        loops._passed_over = loop_closure.EVERY - 1
        image = half_way().images[-1]
        assert isinstance(image, GroundImage)
        loops.consider(image.depth if depth else None, inertial=False)
        return any(loops.go_on() for _ in takewhile(lambda _: loops.under_way, count()))

    def assert_unchanged(self) -> None:
        now, before = loop_closure.MapSnapshot.of(self.slam.map), self.before
        for a, b in zip(now.states, before.states, strict=True):
            np.testing.assert_array_equal(a.pose().matrix(), b.pose().matrix())
        for seen, seen_before in zip(now.sightings, before.sightings, strict=True):
            for c, d in zip(seen, seen_before, strict=True):
                np.testing.assert_array_equal(c, d)
        np.testing.assert_array_equal(now.positions, before.positions)
        np.testing.assert_array_equal(now.point_states, before.point_states)
        np.testing.assert_array_equal(self.slam.tracker.ids, self.followed)


@pytest.fixture
def twin() -> Twin:
    return Twin()


def test_a_place_too_far_for_drift_is_another_one(
    twin: Twin, monkeypatch: pytest.MonkeyPatch
) -> None:
    found: list[Found] = []
    again = twin.slam._recovery.again

    def watched(*args: object) -> Found | None:
        place = again(*args)  # type: ignore[arg-type]
        found.extend([] if place is None else [place])
        return place

    monkeypatch.setattr(twin.slam._recovery, "again", watched)
    assert not twin.close()
    assert len(found[0].ids) >= loop_closure.MIN_AGREEING, "it was a good likeness"
    twin.assert_unchanged()


def test_a_wrong_loop_is_undone(twin: Twin, monkeypatch: pytest.MonkeyPatch) -> None:
    """Believed at first, it does not fit what the robot saw on its way."""
    monkeypatch.setattr(loop_closure, "DRIFT_M", 100.0)
    monkeypatch.setattr(loop_closure, "MAX_TURN", np.pi)
    tried: list[bool] = []
    straighten = loop_closure.straighten

    def watched(*args: object) -> None:
        tried.append(True)
        straighten(*args)  # type: ignore[arg-type]

    monkeypatch.setattr(loop_closure, "straighten", watched)
    assert not twin.close()
    assert tried
    twin.assert_unchanged()


def test_a_tilted_place_is_another_one_where_the_vertical_is_known(
    twin: Twin, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(loop_closure, "DRIFT_M", 100.0)
    monkeypatch.setattr(loop_closure, "MAX_TURN", np.pi)
    loops, slam = twin.slam._loops, twin.slam
    old, newest = list(range(4)), slam.map.keyframes[-1]
    there = slam._recovery.recognize(newest, [slam.map.keyframes[k].stamp_ns for k in old])
    assert there is not None
    place = slam._recovery.again(newest, there, old, np.empty(0, np.int64))
    assert place is not None
    assert loops._believable(newest, place, old, inertial=True)
    tilt = SE3.from_rotation_vector((np.deg2rad(3.0), 0.0, 0.0))
    newest.state = newest.state.moved(tilt)
    assert not loops._believable(newest, place, old, inertial=True)
    assert loops._believable(newest, place, old, inertial=False)


def test_without_depth_or_accelerometer_no_loop_is_closed(twin: Twin) -> None:
    assert twin.slam._recovery.resembling(twin.slam.map.keyframes[-1], [0])
    assert not twin.close(depth=False)
    assert not twin.slam._loops.under_way
    twin.assert_unchanged()

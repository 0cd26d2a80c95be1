"""What is culled is covered, and what hung on it stays where it was."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from airground.config import Config, KeyframeSlam
from airground.core.camera import PinholeCamera
from airground.core.cloud import Source
from airground.core.se3 import SE3
from airground.core.trajectory import Trajectory
from airground.slam import culling
from airground.slam.culling import COVERED_BY, COVERED_SHARE, KeyframeCuller
from airground.slam.front_end import Tracking
from airground.slam.map_adjustment import MapAdjuster
from airground.slam.monocular import MonocularSlam
from airground.slam.reacquisition import BORDER_PX, MAX_TURN_DEG, MAX_ZOOM
from airground.slam.recovery import Recovery
from airground.slam.rgbd import RgbdSlam
from airground.slam.rig_state import RigState
from airground.slam.sparse_map import Keyframe, SparseMap
from airground.slam.tracked_path import TrackedPath
from tests.slam.hard_sequences import Leg, drive, flight
from tests.slam.synthetic_world import R_BODY_DOWN, Sequence
from tests.slam.views import CAMERA

T_RIG_CAMERA = SE3(R_BODY_DOWN, np.array([0.05, 0.01, -0.03]))
PARAMETERS = KeyframeSlam(window=4, fixed_keyframes=3)
INTERVAL_NS = 400_000_000
MANY = 240


def covered_slowly(
    sparse_map: SparseMap,
    keyframe: int,
    window: int,
    camera: PinholeCamera,
    T_rig_camera: SE3,
) -> bool:
    """The same rule, one point and one keyframe at a time."""
    poses = [k.state.pose() @ T_rig_camera for k in sparse_map.keyframes]
    ids = [int(i) for i in sparse_map.keyframes[keyframe].ids if sparse_map.mapped(np.array([i]))]
    if not ids:
        return True
    points = [sparse_map.positions[i] for i in ids]
    middle = sum(points) / len(points)
    own_depth = (poses[keyframe].inverse() @ middle)[2]
    others = []
    for k in range(len(poses) - window - 1):
        depth = (poses[k].inverse() @ middle)[2]
        turn_deg = np.rad2deg((poses[k].inverse() @ poses[keyframe]).angle())
        zoom = max(depth / own_depth, own_depth / depth)
        if k != keyframe and turn_deg < MAX_TURN_DEG and 0 < zoom < MAX_ZOOM:
            others.append(poses[k].inverse())
    in_view = 0
    for point in points:
        views = 0
        for pose in others:
            seen = pose @ point
            if seen[2] <= 0:
                continue
            x = camera.fx * seen[0] / seen[2] + camera.cx
            y = camera.fy * seen[1] / seen[2] + camera.cy
            views += (BORDER_PX <= x < camera.width - BORDER_PX) and (
                BORDER_PX <= y < camera.height - BORDER_PX
            )
        in_view += views >= COVERED_BY
    return in_view / len(points) >= COVERED_SHARE


class Crowd:
    """Cameras that look down on points from here and there, without images."""

    def __init__(self, count: int, spread_m: float, seed: int) -> None:
        rng = np.random.default_rng(seed)
        self.map = SparseMap()
        ids = self.map.new_points(np.zeros((300, 2)), 0)
        self.map.place(ids, rng.uniform((-2, -2, -0.3), (2, 2, 0.3), (300, 3)))
        own = CAMERA, T_RIG_CAMERA, PARAMETERS
        self.adjuster = MapAdjuster(self.map, *own, 1.0)
        self.recovery = Recovery(self.map, *own)
        self.path = TrackedPath()
        self.culler = KeyframeCuller(self.map, self.adjuster, self.recovery, self.path, *own)
        for _ in range(count):
            self.add(rng, spread_m)

    def add(self, rng: np.random.Generator, spread_m: float) -> None:
        """One more keyframe, with an image of the path, that sees what is in view."""
        place = rng.uniform(-spread_m, spread_m, 3) + np.array([0.0, 0.0, 2.0])
        turn = SE3.from_rotation_vector(rng.uniform(-1, 1, 3) * min(spread_m, 0.15), place)
        keyframes = self.map.keyframes
        camera = turn @ T_RIG_CAMERA
        pixels = CAMERA.project(camera.inverse() @ self.map.positions[:300])
        with np.errstate(invalid="ignore"):
            seen = ((pixels > 0) & (pixels < (CAMERA.width, CAMERA.height))).all(axis=1)
        image = np.zeros((CAMERA.height, CAMERA.width), np.uint8)
        keyframes.append(
            Keyframe(
                self.map.made * INTERVAL_NS,
                image,
                RigState.at_origin().posed(turn),
                np.flatnonzero(seen),
                pixels[seen],
                np.full(int(seen.sum()), np.nan),
            )
        )
        self.recovery.add_keyframe()
        self.path.note(keyframes[-1].stamp_ns, camera, keyframes)


@settings(deadline=None, max_examples=25)
@given(st.integers(8, 24), st.floats(0.0, 0.8), st.integers(0, 1000))
def test_covered_as_by_the_slow_twin(count: int, spread_m: float, seed: int) -> None:
    crowd = Crowd(count, spread_m, seed)
    for k in range(count - PARAMETERS.window - 1):
        slow = covered_slowly(crowd.map, k, PARAMETERS.window, CAMERA, T_RIG_CAMERA)
        assert crowd.culler.covered(k) == slow


@pytest.mark.parametrize("spread_m", [0.02, 0.5])
def test_keyframes_of_a_bounded_area_stay_bounded(spread_m: float) -> None:
    crowd, rng = Crowd(0, 0.0, 0), np.random.default_rng(1)
    counts = []
    for _ in range(MANY):
        crowd.add(rng, spread_m)
        crowd.culler.cull(inertial=False)
        counts.append(len(crowd.map.keyframes))
    assert crowd.map.made == MANY
    # Hardly anything that comes in the second half stays.
    assert max(counts[MANY // 2 :]) - counts[MANY // 2] <= 0.08 * MANY / 2
    if spread_m < 0.1:  # in one place: those that cover it, the first, and the window
        assert counts[-1] <= PARAMETERS.window + COVERED_BY + 4
    # Every image is still where it was.
    path = crowd.path.trajectory(crowd.map.keyframes)
    assert path is not None
    assert len(path) == MANY
    # The first, and the window, are there; looking for them again finds no other.
    stamps = [keyframe.stamp_ns for keyframe in crowd.map.keyframes]
    assert stamps[0] == 0
    newest = [n * INTERVAL_NS for n in range(MANY - 1 - PARAMETERS.window, MANY)]
    assert stamps[-len(newest) :] == newest
    assert sorted(crowd.recovery._index._point_ids) == stamps


def error_m(sequence: Sequence, path: Trajectory) -> float:
    """RMS distance of images to where they were taken, after one alignment of all [m]."""
    truth = [sequence.T_world_camera.at(int(stamp)).translation for stamp in path.stamps_ns]
    here, there = np.array(path.translations), np.array(truth)
    u, _, vt = np.linalg.svd((there - there.mean(axis=0)).T @ (here - here.mean(axis=0)))
    turn = u @ np.diag([1.0, 1.0, np.linalg.det(u @ vt)]) @ vt
    off = (here - here.mean(axis=0)) @ turn.T - (there - there.mean(axis=0))
    return float(np.sqrt(np.mean(np.sum(off**2, axis=1))))


class Watched:
    """A run of SLAM whose culler is watched."""

    def __init__(self, sequence: Sequence) -> None:
        kind = MonocularSlam if sequence.robot == Source.MAV else RgbdSlam
        front_end: Any = kind(sequence.calibration, Config(), np.random.default_rng(0))
        self.slam = front_end._slam
        self.uncovered: list[int] = []
        sparse_map, cull = self.slam.map, self.slam.map.cull

        def watched(keyframe: int) -> None:
            window = self.slam.parameters.window
            own = sequence.calibration.camera, sequence.calibration.T_imu_camera
            inside = 1 <= keyframe < len(sparse_map.keyframes) - window - 1
            if not inside or not covered_slowly(sparse_map, keyframe, window, *own):
                self.uncovered.append(keyframe)
            cull(keyframe)

        sparse_map.cull = watched
        self.tracked = sequence.feed(front_end)
        path = front_end.trajectory()
        assert path is not None
        self.path = path
        self.error_m = error_m(sequence, path)


LONG_WAYS = {
    Source.GROUND: (Leg(1.0), Leg(6.0, speed_mps=0.4, sway=1.0), Leg(14.0)),
    Source.MAV: (
        Leg(1.0),
        Leg(1.5, climb_mps=1.0),
        Leg(24.0, speed_mps=0.7, sway=1.0),
        Leg(5.0, sway=1.0),
    ),
}


@pytest.mark.slow
@pytest.mark.parametrize("robot", [Source.MAV, Source.GROUND])
def test_long_ways_keep_their_accuracy_with_fewer_keyframes(
    robot: Source, monkeypatch: pytest.MonkeyPatch
) -> None:
    legs = LONG_WAYS[robot]
    sequence = flight(*legs, height_m=0.4) if robot == Source.MAV else drive(*legs)
    run = Watched(sequence)
    monkeypatch.setattr(culling, "COVERED_BY", 10**6)
    whole = Watched(sequence)
    assert whole.slam.map.culled == 0
    assert run.slam.map.culled > 0.2 * run.slam.map.made
    assert not run.uncovered
    # All images are tracked, and all are in the path.
    given = [pose.stamp_ns for pose in run.tracked if pose.tracking is Tracking.TRACKED]
    stamps_ns = run.path.stamps_ns.tolist()
    assert stamps_ns[-len(given) :] == given
    assert stamps_ns[0] <= given[0]  # back to the first view of the map
    assert len(stamps_ns) >= len(whole.path)
    assert run.error_m < 1.25 * whole.error_m + 1e-3


@pytest.mark.slow
def test_numbers_of_points_change_no_pose(monkeypatch: pytest.MonkeyPatch) -> None:
    """Renumbered at every keyframe, the map gives the same poses to the last bit."""
    monkeypatch.setattr(culling, "COVERED_BY", 1)
    monkeypatch.setattr(culling, "COVERED_SHARE", 0.3)
    sequence = drive(Leg(0.5), Leg(4.0, speed_mps=0.4, sway=1.0), Leg(2.0))
    plain = Watched(sequence)
    compact = SparseMap.compact

    def at_once(sparse_map: SparseMap) -> None:
        sparse_map._compact_at = 0
        compact(sparse_map)

    monkeypatch.setattr(SparseMap, "compact", at_once)
    run = Watched(sequence)
    assert run.slam.map.culled > 0
    assert len(run.slam.map) < len(plain.slam.map)
    np.testing.assert_array_equal(run.path.translations, plain.path.translations)
    np.testing.assert_array_equal(run.path.rotations, plain.path.rotations)

"""Closing loops that drift has opened: a place is seen again, but not where it is expected.

Small drift never opens a loop: `LocalMapper` finds old points by projection. This is for what
is left after a long way through places not seen before.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from airground.config import KeyframeSlam
from airground.core.arrays import F32, F64, I8, I64
from airground.core.camera import PinholeCamera
from airground.core.se3 import SE3
from airground.slam.bundle_adjustment import Pieces
from airground.slam.feature_tracker import FeatureTracker
from airground.slam.map_adjustment import FIRST_STEPS, GLOBAL, MOST_AT_ONCE, MapAdjuster
from airground.slam.pose_graph import MIN_SHARED, Edge, straighten
from airground.slam.recovery import Found, Recovery
from airground.slam.rig_state import RigState
from airground.slam.sparse_map import Keyframe, SparseMap

EVERY = 3
"""Comparing a keyframe with all old ones takes as long as tracking some images: only every third
is compared."""
MIN_AGREEING = 25
"""Old points, each good to a pixel, that must agree on one pose."""
MAX_TILT = np.deg2rad(2.0)
"""Where the accelerometer counts, the vertical does not drift: a place that looks tilted by more
is another."""
DRIFT_SHARE, DRIFT_M = 0.1, 0.2
"""No robot here drifts farther than this share of its way, and so much besides."""
MAX_TURN = np.deg2rad(20.0)
MIN_DRIFT_PX = 3.0
"""Off by less, old points are found by projection soon."""
MIN_FITTING = 0.7
"""Share of the old points that must still be seen where they are after adjustment ..."""
MAX_LOST = 0.03
"""... and share of all sightings that may be lost by it: a wrong loop bends the map."""


@dataclass(eq=False)
class LoopCloser:
    """Recognizes old places and straightens the map by them.

    Work is spread over the images after a keyframe, a piece at each: likenesses are counted, the
    place is recognized, the map is corrected. Keyframes may be made or culled meanwhile, so that
    pieces hand on keyframes and poses, but neither indices nor numbers of points.
    """

    map: SparseMap
    tracker: FeatureTracker
    adjuster: MapAdjuster
    recovery: Recovery
    camera: PinholeCamera
    T_rig_camera: SE3
    parameters: KeyframeSlam
    max_depth_m: float = np.inf
    _passed_over: int = field(default=0, init=False)
    _work: Pieces[bool] | None = field(default=None, init=False)

    @property
    def under_way(self) -> bool:
        """Whether a keyframe is still being compared."""
        return self._work is not None

    def consider(self, depth: F32 | None, inertial: bool) -> None:
        """Compare the newest keyframe with old ones from the next image on, if it is its turn.
        `depth` is the keyframe's (height, width) depth [m]; None without a depth camera."""
        # Without depth or accelerometer the scale drifts, too, which this cannot mend.
        if len(self.map.keyframes) - 1 <= self.parameters.window or not (
            depth is not None or inertial
        ):
            return
        self._passed_over = (self._passed_over + 1) % EVERY
        if self._passed_over == 0 and self.parameters.reused_keyframes > 0:
            self._work = self._closing(self.map.keyframes[-1], depth, inertial)

    def go_on(self) -> bool:
        """Do a piece of the work under way; returns whether it corrected the whole map."""
        assert self._work is not None
        try:
            next(self._work)
        except StopIteration as finished:
            self._work = None
            return bool(finished.value)
        return False

    def drop(self) -> None:
        """The map was scaled or turned: what was found in it is of no use."""
        self._work = None

    def _closing(self, keyframe: Keyframe, depth: F32 | None, inertial: bool) -> Pieces[bool]:
        """In pieces, correct the map if a keyframe shows an old place; returns whether it did."""
        alike = self.recovery.resembling(keyframe, self._old(keyframe))
        if not alike:
            return False
        yield
        T_map_camera = self.recovery.recognize(keyframe, alike)
        if T_map_camera is None:
            return False
        yield
        old = self._old(keyframe)
        if not old:
            return False
        found = self.recovery.again(keyframe, T_map_camera, old, self._recent(keyframe))
        if found is None or not self._believable(keyframe, found, old, inertial):
            return False
        return self._correct(keyframe, found, self._best(found, old), depth, inertial)

    def _first_recent(self, keyframe: Keyframe) -> int:
        return self.map.keyframes.index(keyframe) - self.parameters.window

    def _recent(self, keyframe: Keyframe) -> I64:
        """Numbers of the points that a keyframe, those of the window before it, or later ones
        saw."""
        recent = range(self._first_recent(keyframe), len(self.map.keyframes))
        return self.map.seen_by(list(recent))

    def _old(self, keyframe: Keyframe) -> list[int]:
        """Keyframes before the window that share no points with recent ones: those that do are
        reached by projection."""
        shared = self.map.shared(self._recent(keyframe))[: self._first_recent(keyframe)]
        return [int(k) for k in np.flatnonzero(shared < MIN_SHARED)]

    def _best(self, found: Found, old: list[int]) -> int:
        """The old keyframe that saw most of the points."""
        shared = self.map.shared(found.ids)
        return max(old, key=lambda k: int(shared[k]))

    def _believable(self, keyframe: Keyframe, found: Found, old: list[int], inertial: bool) -> bool:
        """Whether enough points agree and a robot can have drifted so far."""
        if len(found.ids) < MIN_AGREEING:
            return False
        T_map_camera = keyframe.state.pose() @ self.T_rig_camera
        correction = found.fit.T_map_camera @ T_map_camera.inverse()
        expected = self.camera.project(T_map_camera.inverse() @ self.map.positions[found.ids])
        straight = keyframe.shutter.straight(found.pixels)
        off_px = np.nan_to_num(np.linalg.norm(expected - straight, axis=1), nan=np.inf)
        if np.median(off_px) < MIN_DRIFT_PX:
            return False
        tilt = np.arccos(min(1.0, correction.rotation[2, 2]))
        if inertial and tilt > MAX_TILT:
            return False
        between = slice(self._best(found, old), self.map.keyframes.index(keyframe) + 1)
        steps = [passed.state.position for passed in self.map.keyframes[between]]
        way = np.linalg.norm(np.diff(steps, axis=0), axis=1).sum()
        shift = found.fit.T_map_camera.translation - T_map_camera.translation
        drifted = np.linalg.norm(shift) < DRIFT_M + DRIFT_SHARE * way
        return bool(drifted and correction.angle() < MAX_TURN)

    def _correct(
        self, keyframe: Keyframe, found: Found, old: int, depth: F32 | None, inertial: bool
    ) -> bool:
        """Pose graph, then bundle adjustment of everything; undone if the loop does not fit. Of a
        large map only the first steps are taken: `WholeMap.go_on` goes on. The next keyframe
        finds the old points by projection."""
        before = MapSnapshot.of(self.map)
        T_map_rig = found.fit.T_map_camera @ self.T_rig_camera.inverse()
        T_old_keyframe = self.map.keyframes[old].state.pose().inverse() @ T_map_rig
        index = self.map.keyframes.index(keyframe)
        straighten(self.map, Edge(old, index, T_old_keyframe, float(len(found.ids))))
        depths = keyframe.shutter.inverse_depths_at(depth, found.pixels, self.max_depth_m)
        keyframe.see(found.ids, keyframe.shutter.straight(found.pixels), depths)
        large = len(self.map.keyframes) > MOST_AT_ONCE
        self.adjuster.adjust_all(inertial, FIRST_STEPS if large else GLOBAL)
        fitting = np.isin(found.ids, keyframe.ids) & self.map.mapped(found.ids)
        left = sum(len(one.ids) for one in self.map.keyframes) - fitting.sum()
        if fitting.mean() < MIN_FITTING or left < (1.0 - MAX_LOST) * before.sighting_count():
            before.restore(self.map)
            return False
        misfits = np.setdiff1d(before.sightings[-1][0], self.map.keyframes[-1].ids)
        self.tracker.keep(~np.isin(self.tracker.ids, misfits))
        return True


@dataclass(frozen=True, eq=False)
class MapSnapshot:
    """What adjustment changes of a map, to restore when a correction proves wrong; `sightings` are
    the keyframes' `ids`, `pixels` and `inverse_depths`, which are replaced, never written to."""

    states: list[RigState]
    sightings: list[tuple[I64, F64, F64]]
    positions: F64
    point_states: I8

    @classmethod
    def of(cls, sparse_map: SparseMap) -> MapSnapshot:
        keyframes = sparse_map.keyframes
        return cls(
            [keyframe.state for keyframe in keyframes],
            [(keyframe.ids, keyframe.pixels, keyframe.inverse_depths) for keyframe in keyframes],
            sparse_map.positions.copy(),
            sparse_map.states.copy(),
        )

    def sighting_count(self) -> int:
        """How often a point was seen."""
        return sum(len(ids) for ids, _, _ in self.sightings)

    def restore(self, sparse_map: SparseMap) -> None:
        """Undo; the map must have neither new keyframes nor new points since."""
        for n, keyframe in enumerate(sparse_map.keyframes):
            keyframe.state = self.states[n]
            keyframe.ids, keyframe.pixels, keyframe.inverse_depths = self.sightings[n]
        sparse_map.positions[:] = self.positions
        sparse_map.states[:] = self.point_states

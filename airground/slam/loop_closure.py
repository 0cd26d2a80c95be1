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
from airground.slam.feature_tracker import FeatureTracker
from airground.slam.local_mapping import CROWDED
from airground.slam.map_adjustment import FIRST_STEPS, GLOBAL, MOST_AT_ONCE, MapAdjuster
from airground.slam.pose_graph import MIN_SHARED, Edge, straighten
from airground.slam.recovery import Found, Recovery
from airground.slam.rig_state import RigState
from airground.slam.sparse_map import SparseMap

EVERY = 3
"""Comparing a keyframe with all old ones takes as long as tracking an image: only every third
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
    """Recognizes old places and straightens the map by them."""

    map: SparseMap
    tracker: FeatureTracker
    adjuster: MapAdjuster
    recovery: Recovery
    camera: PinholeCamera
    T_rig_camera: SE3
    parameters: KeyframeSlam
    max_depth_m: float = np.inf
    _passed_over: int = field(default=0, init=False)

    def close(self, depth: F32 | None, inertial: bool) -> bool:
        """Correct the whole map if the newest keyframe shows an old place; returns whether it did.
        `depth` is the keyframe's (height, width) depth [m]; None without a depth camera."""
        first_recent = len(self.map.keyframes) - 1 - self.parameters.window
        # Without depth or accelerometer the scale drifts, too, which this cannot mend.
        if first_recent <= 0 or (depth is None and not inertial):
            return False
        self._passed_over = (self._passed_over + 1) % EVERY
        if self._passed_over or self.parameters.reused_keyframes == 0:
            return False
        recent = self.map.seen_by(list(range(first_recent, len(self.map.keyframes))))
        # Keyframes that share points with recent ones are reached by projection.
        shared = self.map.shared(recent)[:first_recent]
        old = [int(k) for k in np.flatnonzero(shared < MIN_SHARED)]
        if not old:
            return False
        found = self.recovery.again(old, recent)
        if found is None or not self._believable(found, old, inertial):
            return False
        return self._correct(found, self._best(found, old), depth, inertial)

    def _best(self, found: Found, old: list[int]) -> int:
        """The old keyframe that saw most of the points."""
        shared = self.map.shared(found.ids)
        return max(old, key=lambda k: int(shared[k]))

    def _believable(self, found: Found, old: list[int], inertial: bool) -> bool:
        """Whether enough points agree and a robot can have drifted so far."""
        if len(found.ids) < MIN_AGREEING:
            return False
        T_map_camera = self.map.keyframes[-1].state.pose() @ self.T_rig_camera
        correction = found.fit.T_map_camera @ T_map_camera.inverse()
        expected = self.camera.project(T_map_camera.inverse() @ self.map.positions[found.ids])
        straight = self.map.keyframes[-1].shutter.straight(found.pixels)
        off_px = np.nan_to_num(np.linalg.norm(expected - straight, axis=1), nan=np.inf)
        if np.median(off_px) < MIN_DRIFT_PX:
            return False
        tilt = np.arccos(min(1.0, correction.rotation[2, 2]))
        if inertial and tilt > MAX_TILT:
            return False
        steps = [keyframe.state.position for keyframe in self.map.keyframes]
        way = np.linalg.norm(np.diff(steps[self._best(found, old) :], axis=0), axis=1).sum()
        shift = found.fit.T_map_camera.translation - T_map_camera.translation
        drifted = np.linalg.norm(shift) < DRIFT_M + DRIFT_SHARE * way
        return bool(drifted and correction.angle() < MAX_TURN)

    def _correct(self, found: Found, old: int, depth: F32 | None, inertial: bool) -> bool:
        """Pose graph, then bundle adjustment of everything; undone if the loop does not fit. Of a
        large map only the first steps are taken: `WholeMap.loop_closed` goes on."""
        newest = self.map.keyframes[-1]
        before = MapSnapshot.of(self.map)
        T_map_rig = found.fit.T_map_camera @ self.T_rig_camera.inverse()
        T_old_newest = self.map.keyframes[old].state.pose().inverse() @ T_map_rig
        last = len(self.map.keyframes) - 1
        straighten(self.map, Edge(old, last, T_old_newest, float(len(found.ids))))
        depths = newest.shutter.inverse_depths_at(depth, found.pixels, self.max_depth_m)
        newest.see(found.ids, newest.shutter.straight(found.pixels), depths)
        large = len(self.map.keyframes) > MOST_AT_ONCE
        self.adjuster.adjust_all(inertial, FIRST_STEPS if large else GLOBAL)
        fitting = np.isin(found.ids, newest.ids) & self.map.mapped(found.ids)
        left = sum(len(keyframe.ids) for keyframe in self.map.keyframes) - fitting.sum()
        if fitting.mean() < MIN_FITTING or left < (1.0 - MAX_LOST) * before.sighting_count():
            before.restore(self.map)
            return False
        self.tracker.keep(np.isin(self.tracker.ids, newest.ids))
        self.tracker.add(found.ids[fitting], found.pixels[fitting])
        self.tracker.thin(CROWDED * self.parameters.corner_spacing_px)
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

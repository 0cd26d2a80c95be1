"""Which part of the sparse map bundle adjustment moves, and what becomes of its result."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from airground.config import KeyframeSlam
from airground.core.arrays import F64, I64
from airground.core.camera import PinholeCamera
from airground.core.messages import USUAL_BIAS_MPS2
from airground.core.se3 import SE3
from airground.slam.bundle_adjustment import Role, Settings, adjust
from airground.slam.inertial.joining import join
from airground.slam.inertial.preintegration import Preintegration
from airground.slam.map_problem import MapProblem
from airground.slam.rig_state import RigState
from airground.slam.sparse_map import Keyframe, SparseMap

WINDOW_DECREASE = 1e-5
"""Adjustment of a window ends when a step lowers the cost by less than this share."""
GLOBAL = Settings(iterations=15, relative_decrease=1e-6, covariance=False)
"""For a whole map, whose scale moves far for little cost."""
FIRST_STEPS = Settings(iterations=4, relative_decrease=1e-6, covariance=False)
"""For a whole map that is adjusted again at once: the beginning shows whether it fits."""
MOST_AT_ONCE = 48
"""A map of so many keyframes is adjusted at once: 37 to 54 ms of processor time for 54 to 56, 54
and 81 ms for 64, after one and two laps over the same ground."""

FIRST_ALL = 8
ALL_GROWTH = 1.5
"""The whole map is adjusted at so many keyframes, and whenever it has grown by this factor: what
the beginning got wrong shows only later, and would bend all that stands on it."""
MOST_BETWEEN_ALL = 200
"""No later than after so many new keyframes it is adjusted again: then the old ones are settled,
and may be culled with their inertial motions."""
SETTLING_NS = 60_000_000_000
"""After so much flight the scale of what is older is known to the per mille."""
MAX_JOINED_S = 3.0
"""Longer than this, the bias of an accelerometer does not stay what it was (the same limit as in
Campos et al., "ORB-SLAM3", T-RO 2021)."""


@dataclass(eq=False)
class MapAdjuster:
    """Bundle adjustment over a sparse map.

    Attributes:
        inverse_depth_sigma: Standard deviation of measured inverse depth [1/m].
        bias_sigma: Standard deviation of the accelerometer's bias per axis at the start [m/s^2].
        motions: Inertial motion before each keyframe, by its index, where known.
        turns: Whether gyro turns between keyframes count where inertia does not; the gyro's bias
            at the first keyframe must then be known.
        settled_ns: Keyframes up to this stamp took part in adjusting the whole map long after
            they were made, and hold what their inertial motions had to tell.
    """

    map: SparseMap
    camera: PinholeCamera
    T_rig_camera: SE3
    parameters: KeyframeSlam
    inverse_depth_sigma: float
    bias_sigma: float = USUAL_BIAS_MPS2
    motions: dict[int, Preintegration] = field(default_factory=dict, init=False)
    turns: bool = field(default=False, init=False)
    settled_ns: int = field(default=np.iinfo(np.int64).min, init=False)
    _next_all: int = field(default=FIRST_ALL, init=False)

    def adjust_window(self, inertial: bool) -> F64 | None:
        """Move the newest keyframes and their points; older ones that saw them hold still.

        The IMU counts if `inertial`: the map is metric and gravity-aligned. Returns the (6, 6)
        covariance of the newest keyframe's pose, with the vertical taken as exact; None where the
        vertical is adjusted, too.
        """
        count = len(self.map.keyframes)
        first_free = max(1, count - self.parameters.window)
        free = list(range(first_free, count))
        if not free:
            return None
        fixed = self._holding(free)
        roles = np.array([Role.FIXED] * len(fixed) + [Role.FREE] * len(free))
        begins = inertial and first_free == 1
        if begins:
            # Tilt and biases of the beginning become known only by moving.
            roles[0] = Role.GAUGE
        settings = Settings(
            self.parameters.iterations,
            relative_decrease=WINDOW_DECREASE,
            covariance=not begins,
        )
        return self._adjust(fixed + free, roles, inertial, settings)

    def adjust_all(self, inertial: bool, settings: Settings = GLOBAL) -> None:
        """Move the whole map, as `whole_map` has it."""
        keyframes = self.map.keyframes
        self.settle(keyframes[-1])
        self._adjust(list(range(len(keyframes))), self._roles(inertial), inertial, settings)

    def whole_map(self, inertial: bool) -> MapProblem:
        """The whole map as it is, to be adjusted with the settings `GLOBAL`.

        With an IMU, place and heading of the newest keyframe's camera stay, so that a better
        vertical turns the past about it instead of moving it about the past. Without,
        the first keyframe stays, since only there it is known where up is. Keyframes that
        culling left without their inertial motion stay in either case.
        """
        return self._problem(list(range(len(self.map.keyframes))), self._roles(inertial), inertial)

    def settle(self, newest: Keyframe) -> None:
        """The whole map up to a keyframe was adjusted."""
        self.settled_ns = newest.stamp_ns - SETTLING_NS

    def all_due(self) -> bool:
        """Whether the newest keyframe makes it time to adjust the whole map; to be asked once."""
        due = self.map.made >= self._next_all
        if due:
            grown = int(ALL_GROWTH * self._next_all)
            self._next_all = min(grown, self._next_all + MOST_BETWEEN_ALL)
        return due

    def can_skip(self, keyframe: int) -> bool:
        """Whether a keyframe may go without a loss of inertial information."""
        if self.map.keyframes[keyframe + 1].stamp_ns <= self.settled_ns:
            return True
        before, after = self.motions.get(keyframe), self.motions.get(keyframe + 1)
        if before is None or after is None:
            return before is after
        return before.duration_s + after.duration_s <= MAX_JOINED_S

    def skip(self, keyframe: int, inertial: bool) -> None:
        """Join the motions before and after a keyframe that is about to be culled.
        Motions that are too long, or not known on both sides, go; their other ends then hold
        if inertia counts (`inertial`)."""
        before, after = self.motions.pop(keyframe, None), self.motions.pop(keyframe + 1, None)
        self.motions = {k if k < keyframe else k - 1: m for k, m in self.motions.items()}
        if before is None and after is None:
            return
        if before is not None and after is not None:
            joined = join(before, after)
            if joined.duration_s <= MAX_JOINED_S:
                self.motions[keyframe] = joined
                return
        for neighbour in (keyframe - 1, keyframe + 1):
            self.map.keyframes[neighbour].held |= inertial

    def _roles(self, inertial: bool) -> I64:
        """(K,) `Role` of each keyframe where all are adjusted."""
        keyframes = self.map.keyframes
        roles = np.full(len(keyframes), Role.FREE)
        roles[[keyframe.held for keyframe in keyframes]] = Role.FIXED
        if not inertial:
            roles[0] = Role.FIXED
        elif not (roles == Role.FIXED).any():
            roles[-1] = Role.GAUGE
        return roles

    def _holding(self, free: list[int]) -> list[int]:
        """Older keyframes that share the most points with the free ones, in order of time.
        The one just before the window is always among them: inertial motion starts there."""
        shared = self.map.shared(self.map.seen_by(free))[: free[0]]
        shared[-1] = np.iinfo(shared.dtype).max
        best = np.argsort(-shared, kind="stable")[: self.parameters.fixed_keyframes]
        return sorted(int(k) for k in best if shared[k] > 0)

    def _adjust(
        self, chosen: list[int], roles: I64, inertial: bool, settings: Settings
    ) -> F64 | None:
        problem = self._problem(chosen, roles, inertial)
        place = self.place_that_stays(problem)
        settings = self.with_prior(settings)
        result = adjust(*problem.parts(), self.camera, self.T_rig_camera, settings)
        states = result.states
        for n, keyframe in enumerate(problem.keyframes):
            before = keyframe.state
            keyframe.state = RigState(
                states.rotations[n],
                states.positions[n],
                states.velocities[n] if inertial else before.velocity,
                states.gyro_biases[n],
                states.accelerometer_biases[n] if inertial else before.accelerometer_bias,
            )
        self.map.positions[problem.points] = result.points
        self.keep_place(problem, place)
        problem.drop_misfits(self.map, result.residuals_px, self.parameters.corner_sigma_px)
        return result.covariance

    def with_prior(self, settings: Settings) -> Settings:
        """The settings with what is known of the accelerometer's bias beforehand."""
        return replace(settings, accelerometer_bias_prior_sigma=self.bias_sigma)

    def place_that_stays(self, problem: MapProblem) -> F64 | None:
        """(3,) where the camera of the keyframe without a free place is now [m]; None where others
        hold the map."""
        if Role.GAUGE not in problem.roles:
            return None
        keyframe = problem.keyframes[int(np.argmax(problem.roles == Role.GAUGE))]
        return (keyframe.state.pose() @ self.T_rig_camera).translation

    def keep_place(self, problem: MapProblem, place: F64 | None) -> None:
        """Shift the adjusted map so that this camera is where it was: adjustment holds the IMU,
        about which a better vertical turns the camera."""
        now = self.place_that_stays(problem)
        if place is not None and now is not None:
            self.map.shift(place - now)

    def _problem(self, chosen: list[int], roles: I64, inertial: bool) -> MapProblem:
        moving = [k for k, role in zip(chosen, roles, strict=True) if role != Role.FIXED]
        motions = self.motions if inertial or self.turns else {}
        if not inertial:
            motions = {k: motion.turn_only() for k, motion in motions.items()}
        return MapProblem.of(
            self.map,
            chosen,
            roles,
            self.map.seen_by(moving),
            motions,
            self.parameters,
            self.inverse_depth_sigma,
        )

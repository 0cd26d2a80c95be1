"""Metric scale and the vertical of a monocular map by a Kalman filter, as published (Sec. IV)."""

from __future__ import annotations

import numpy as np

from airground.core.arrays import F64, I64
from airground.slam.front_end import ScaleEstimate
from airground.slam.inertial.alignment import HOPELESS_SIGMA, VisualNoise
from airground.slam.inertial.scale_filter import ScaleFilter
from airground.slam.inertial.stationarity import gravity_aligned
from airground.slam.keyframe_slam import KeyframeSlam
from airground.slam.tight_scale import UNKNOWN_TILT, pose_sigma

SETTLING_S = 4.0
"""Motion that the filter must see before its result is used [s]: a whole take-off, which takes
3 s. While the robot rises, the visual errors depend on each other more than the filter knows."""
FILTER_TILT = np.deg2rad(1.0)
"""Standard deviation of the filter's vertical, in simulation [rad]."""
GIVE_OUT_SIGMA = 0.03
"""Poses are given out when the scale is known this well [share]."""
UNIT_M = 0.1
"""Guess of a map's unit, its first view's median depth: that of a floor from a landing gear [m].
A map with a larger unit only has wider priors."""
WORTH_MOVING = 0.01
"""The map follows the filter's scale when it differs by this share."""


class FilteredScale:
    """Loosely coupled: vision and the gyro's turns make the map, the filter its unit and vertical.

    The map is scaled and turned when the scale is known, and scaled again as the filter learns
    more. The newest camera keeps its place then, and in adjustments of the whole map, so that
    nothing that is being built on it is torn.

    Attributes:
        estimate: How well the scale is known; None before the first inertial motion.
        known: Whether poses may be given out.
        tilt_sigma: How well the vertical is known, per axis [rad].
    """

    @property
    def settled(self) -> bool:
        """Whether scale and vertical are known well."""
        return self.known

    def __init__(self, slam: KeyframeSlam) -> None:
        self.estimate: ScaleEstimate | None = None
        self.known = slam.calibration.imu is None
        self.tilt_sigma = UNKNOWN_TILT
        self._slam = slam
        self._filter = None if self.known else ScaleFilter(slam.T_rig_camera, UNIT_M)
        self._first_ns: int | None = None
        self._last_ns = 0
        self._seen: tuple[I64, F64] | None = None

    def update(self, tracked: bool) -> bool:
        """Take in the newest image, which gave a pose or not; returns whether the map was moved."""
        slam = self._slam
        if self._filter is None or not tracked or slam.stamp_ns is None:
            return False
        self.stay()
        self._learn(self._filter, slam.stamp_ns)
        moved = self._follow(self._filter, slam.stamp_ns)
        ids = slam.tracker.ids[slam.map.mapped(slam.tracker.ids)]
        self._seen = ids, slam.map.positions[ids]
        return moved

    def finish(self) -> None:
        """After the last adjustment: stay, and give a map that is not metric yet the likeliest
        unit, if any."""
        self.stay()
        if self._filter is None or self.known or not self._filter.sigma < HOPELESS_SIGMA:
            return
        gravity = self._filter.gravity
        if gravity is not None and len(self._slam.map.keyframes):
            self._slam.make_upright(self._filter.scale, self._upright(gravity))

    def stay(self) -> None:
        """Where the whole map was adjusted, the view keeps its place and depth: the past moves.
        Adjustment by vision alone leaves both open."""
        slam = self._slam
        before = slam.moved_from
        if before is None or self._seen is None:
            return
        ids, old = self._seen
        kept = slam.map.mapped(ids)
        if kept.sum() < slam.parameters.min_points:
            return
        after = slam.T_map_camera()
        deep = (before.inverse() @ old[kept])[:, 2]
        now_deep = (after.inverse() @ slam.map.positions[ids[kept]])[:, 2]
        scale = float(np.median(deep / now_deep))
        slam.move(scale, before.rotation @ after.rotation.T, before.translation)

    def _upright(self, gravity: F64) -> F64:
        """(3, 3) turn that makes the map upright, with the first view's x axis ahead."""
        slam = self._slam
        right = slam.map.keyframes[0].state.rotation @ slam.T_rig_camera.rotation[:, 0]
        return gravity_aligned(-gravity, right)

    def _learn(self, scale_filter: ScaleFilter, stamp_ns: int) -> None:
        """Feed the filter with the newest image and the motion that led to it."""
        slam = self._slam
        motion = None
        if self._first_ns is None:
            self._first_ns = stamp_ns
        else:
            motion = slam.motion.preintegrate(self._last_ns, stamp_ns, slam.state)
        self._last_ns = stamp_ns
        centre, noise = slam.T_map_camera().translation, VisualNoise(pose_sigma(slam))
        scale_filter.add(slam.state.rotation, centre, noise, motion)
        self.estimate = ScaleEstimate(scale_filter.sigma, scale_filter.observable)

    def _follow(self, scale_filter: ScaleFilter, stamp_ns: int) -> bool:
        """Give the map the filter's unit and vertical, where both are known and differ."""
        slam, gravity = self._slam, scale_filter.gravity
        assert self._first_ns is not None
        settled = (stamp_ns - self._first_ns) * 1e-9 >= SETTLING_S
        if not settled or scale_filter.sigma > GIVE_OUT_SIGMA or gravity is None:
            return False
        scale, here = scale_filter.scale, slam.T_map_camera().translation
        if not self.known:
            turn = self._upright(gravity)
            slam.make_upright(scale, turn)
            scale_filter.follow(scale, turn, np.zeros(3), np.zeros(3))
            self.known, self.tilt_sigma = True, FILTER_TILT
            return True
        if abs(np.log(scale)) < WORTH_MOVING:
            return False
        slam.move(scale, np.eye(3), here)
        scale_filter.follow(scale, np.eye(3), here, here)
        return True

"""Metric scale and the vertical of a monocular map by a Kalman filter, as published (Sec. IV)."""

from __future__ import annotations

import numpy as np

from airground.slam.front_end import ScaleEstimate
from airground.slam.inertial.alignment import VisualNoise
from airground.slam.inertial.scale_filter import ScaleFilter
from airground.slam.inertial.stationarity import gravity_aligned
from airground.slam.keyframe_slam import KeyframeSlam
from airground.slam.tight_scale import UNKNOWN_TILT, pose_sigma

SETTLING_S = 5.0
"""Motion that the filter must see before its result is used [s]."""
FILTER_TILT = np.deg2rad(1.0)
"""Standard deviation of the filter's vertical, in simulation [rad]."""
GIVE_OUT_SIGMA = 0.03
"""Poses are given out when the scale is known this well [share]; more takes half a minute."""


class FilteredScale:
    """Loosely coupled: vision alone makes the map, the filter gives its unit and vertical.

    The map is scaled once, when the scale is known; later corrections would tear apart what
    was built on it.

    Attributes:
        estimate: How well the scale is known; None before the first inertial motion.
        known: Whether poses may be given out.
        tilt_sigma: How well the vertical is known, per axis [rad].
    """

    def __init__(self, slam: KeyframeSlam) -> None:
        self.estimate: ScaleEstimate | None = None
        self.known = slam.calibration.imu is None
        self.tilt_sigma = UNKNOWN_TILT
        self._slam = slam
        self._filter: ScaleFilter | None = None
        self._first_ns = self._last_ns = 0

    def update(self, tracked: bool) -> bool:
        """Take in the newest image, which gave a pose or not; returns whether the map was moved."""
        slam = self._slam
        if self.known or not tracked or slam.stamp_ns is None:
            return False
        stamp_ns, pose = slam.stamp_ns, slam.T_map_camera()
        if self._filter is None:
            self._filter = ScaleFilter(slam.T_rig_camera, VisualNoise(pose_sigma(slam)))
            self._first_ns, motion = stamp_ns, None
        else:
            motion = slam.motion.preintegrate(self._last_ns, stamp_ns, slam.state)
        self._last_ns = stamp_ns
        self._filter.add(slam.state.rotation, pose.translation, motion)
        sigma = self._filter.sigma
        self.estimate = ScaleEstimate(sigma, self._filter.observable)
        settled = (stamp_ns - self._first_ns) * 1e-9 >= SETTLING_S
        gravity = self._filter.gravity
        if not settled or sigma > GIVE_OUT_SIGMA or gravity is None:
            return False
        right = slam.map.keyframes[0].state.rotation @ slam.T_rig_camera.rotation[:, 0]
        slam.make_upright(self._filter.scale, gravity_aligned(-gravity, right))
        self.known, self.tilt_sigma = True, FILTER_TILT
        return True

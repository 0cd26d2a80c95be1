"""Images that a camera repeats while the robot moves: they show an earlier time than they say."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from airground.core.arrays import U8
from airground.core.se3 import rotation_angle
from airground.slam.frame import Frame
from airground.slam.geometry.pose_estimation import PoseFit
from airground.slam.keyframe_slam import KeyframeSlam

MOVED_RAD = 5e-4
"""Least turn from image to image that contradicts a repeated one [rad]: about 0.2 px."""
MOVED_M = 2e-3
"""Least step from image to image that contradicts a repeated one [m]: 0.06 m/s at 30 Hz."""
KEPT_NS = 200_000_000
"""Time for which corners are kept, to be followed into the next new image [ns]."""


class StaleImages:
    """Keeps images from a map that equal the one before, to the last bit, although the IMU says
    that the robot moved.

    Cameras have noise, so that only a repeated image equals another; without noise, those of a
    resting robot do, too.
    """

    def __init__(self, slam: KeyframeSlam) -> None:
        self._slam = slam
        self._last: U8 | None = None
        self._fresh_ns = 0

    def track(self, frame: Frame) -> tuple[PoseFit | None, bool]:
        """`KeyframeSlam.track`; a repeated image has no pose.

        For a moment it is passed over, as if it had been dropped. Then it counts as black, so that
        the state goes on by inertia.
        """
        repeated = self._last is not None and np.array_equal(self._last, frame.image)
        self._last = frame.image
        if not (repeated and frame.image.any() and self._moved(frame.stamp_ns)):
            self._fresh_ns = frame.stamp_ns
            return self._slam.track(frame)
        if frame.stamp_ns - self._fresh_ns <= KEPT_NS:
            return None, False
        return self._slam.track(replace(frame, image=np.zeros_like(frame.image)))

    def _moved(self, stamp_ns: int) -> bool:
        """Whether the IMU says that the robot moved since the newest state."""
        slam = self._slam
        assert slam.stamp_ns is not None
        there = slam.motion.predict(slam.state, np.eye(3), slam.stamp_ns, stamp_ns, slam.inertial)
        if there.rotation_sigma is None:
            return False
        turn = rotation_angle(slam.state.rotation.T @ there.state.rotation)
        step = float(np.linalg.norm(there.state.position - slam.state.position))
        return turn > MOVED_RAD or (there.inertial and step > MOVED_M)

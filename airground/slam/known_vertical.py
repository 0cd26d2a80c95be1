"""How well a vertical is known that an accelerometer gives."""

from __future__ import annotations

import numpy as np

from airground.core.arrays import F64
from airground.slam.inertial.preintegration import GRAVITY

BIAS_MPS2 = 0.05
"""Standard deviation of the accelerometer's bias per axis [m/s^2]."""
READING_MPS2 = 0.01
"""Standard deviation of a second's reading per axis, the motion that images show taken off
[m/s^2]."""
LEVEL_SIGMA = BIAS_MPS2 / GRAVITY
"""Standard deviation of the vertical at rest per axis [rad]."""


class KnownVertical:
    """How well the map of a robot with an accelerometer is level.

    A robot that never turns cannot tell the accelerometer's bias from a map that leans. As it
    turns, the bias turns with it and the vertical stays, so that readings tell them apart. That is
    linear in the two angles by which the map leans and the three values of the bias; the rest of
    what the robot does is taken as known.
    """

    def __init__(self) -> None:
        self._stamp_ns: int | None = None
        self._seconds = 0.0
        self._turned = np.zeros((2, 3))

    def sigma(self, stamp_ns: int, R_map_imu: F64) -> float:
        """Standard deviation of the vertical per axis [rad], after one more image.

        Args:
            stamp_ns: Stamp of the image; the first one begins.
            R_map_imu: (3, 3) rotation of the accelerometer at that time.
        """
        if self._stamp_ns is not None:
            seconds = (stamp_ns - self._stamp_ns) * 1e-9
            self._seconds += seconds
            self._turned += R_map_imu[:2] * seconds
        self._stamp_ns = stamp_ns
        # What readings say of the angles, in seconds of reading, once the bias has had its share.
        prior_s = (READING_MPS2 / BIAS_MPS2) ** 2
        share = self._turned @ self._turned.T / (self._seconds + prior_s)
        known_s = np.linalg.eigvalsh(self._seconds * np.eye(2) - share)
        # The first reading made the map level: it leans by no more than the bias.
        known_s = np.maximum(known_s, prior_s)
        return float(READING_MPS2 / GRAVITY * np.sqrt((1 / known_s).mean()))

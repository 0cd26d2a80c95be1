"""How well a vertical is known that an accelerometer gives."""

from __future__ import annotations

import numpy as np

from airground.core.arrays import F64
from airground.core.messages import ImuNoise
from airground.slam.inertial.preintegration import GRAVITY

READING_MPS2 = 0.004
"""Standard deviation of a second's reading per axis beside its noise, as images show the motion
that is taken off [m/s^2]. So the vertical is known as well as adjustment of the whole map states,
within a factor of 1.5 (two drives of `easy`, docs/diary.md)."""
FIRST_READING_S = 0.2
"""The reading that makes a map level is the mean over so long."""
ASSUMED_SIGMA = 0.05 / GRAVITY
"""Standard deviation of the vertical per axis [rad] of a robot that is taken to stand level."""


class KnownVertical:
    """How well the map of a robot with an accelerometer is level.

    A robot that never turns cannot tell the accelerometer's bias from a map that leans. As it
    turns, the bias turns with it and the vertical stays, so that readings tell them apart. That is
    linear in the two angles by which the map leans and the three values of the bias, which walks;
    the rest of what the robot does is taken as known. A Kalman filter holds their covariance.

    Args:
        noise: Of the accelerometer; None without one.
    """

    def __init__(self, noise: ImuNoise | None) -> None:
        self._noise = noise
        self._stamp_ns: int | None = None
        bias = 0.0 if noise is None else noise.accelerometer_bias_sigma
        # Of gravity along x and y of the map, as far as it leans, and of the bias [m^2/s^4].
        self._covariance = np.diag([GRAVITY**2] * 2 + [bias**2] * 3)
        self.sigma_at_start = self.sigma = ASSUMED_SIGMA

    def read(self, stamp_ns: int, R_map_imu: F64) -> None:
        """Take in the reading of one more image; the first one makes the map level.

        Args:
            stamp_ns: Stamp of the image.
            R_map_imu: (3, 3) rotation of the accelerometer at that time.
        """
        if self._noise is None:
            return
        seconds = FIRST_READING_S
        if self._stamp_ns is not None:
            seconds = (stamp_ns - self._stamp_ns) * 1e-9
            walked = self._noise.accelerometer_bias_walk**2 * seconds
            self._covariance[2:, 2:] += walked * np.eye(3)
        of_a_second = READING_MPS2**2 + self._noise.accelerometer_noise_density**2
        self._update(R_map_imu, of_a_second / seconds)
        self.sigma = float(np.sqrt(np.trace(self._covariance[:2, :2]) / 2)) / GRAVITY
        if self._stamp_ns is None:
            self.sigma_at_start = self.sigma
        self._stamp_ns = stamp_ns

    def _update(self, R_map_imu: F64, variance: float) -> None:
        """A reading of x and y of the map, with the variance of each [m^2/s^4]."""
        reading = np.hstack([np.eye(2), R_map_imu[:2]])
        before = self._covariance
        gain = np.linalg.solve(
            reading @ before @ reading.T + variance * np.eye(2), reading @ before
        ).T
        kept = np.eye(5) - gain @ reading
        self._covariance = kept @ before @ kept.T + variance * gain @ gain.T

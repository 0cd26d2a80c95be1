"""The start of a map for front ends that do not estimate gravity: level, at the first camera."""

from __future__ import annotations

import numpy as np

from airground.core.messages import ImuSamples, RobotCalibration
from airground.core.se3 import SE3, nearest_rotation

GRAVITY_MPS2 = 9.81
REST_TOLERANCE_MPS2 = 0.5
"""Largest difference from gravity at which an accelerometer gives its direction [m/s^2]."""


class LevelStart:
    """Makes z of a map point up, as well as can be known as the first image is taken.

    By the accelerometer where it reads gravity and nothing else; otherwise the body is taken
    to be level, and the calibration says how the camera sits in it.

    Args:
        calibration: Nominal calibration of the robot.
    """

    def __init__(self, calibration: RobotCalibration) -> None:
        self._calibration = calibration
        self._sum = np.zeros(3)
        self._count = 0

    def add_imu(self, samples: ImuSamples) -> None:
        """Take inertial measurements from before the first image."""
        self._sum += samples.accelerometer.sum(axis=0)
        self._count += len(samples.stamps_ns)

    def T_map_camera(self) -> SE3:
        """The first camera in the map: at its origin."""
        T_body_camera = self._calibration.T_body_imu @ self._calibration.T_imu_camera
        rotation = self._tilt() @ T_body_camera.rotation
        return SE3(nearest_rotation(rotation), np.zeros(3))

    def _tilt(self) -> np.ndarray:
        """(3, 3) body to map, without a turn about z to speak of."""
        if self._count == 0:
            return np.eye(3)
        up = self._calibration.T_body_imu.rotation @ (self._sum / self._count)
        length = float(np.linalg.norm(up))
        if abs(length - GRAVITY_MPS2) > REST_TOLERANCE_MPS2:
            return np.eye(3)
        z = up / length
        x = np.array([1.0, 0.0, 0.0]) - z[0] * z
        if np.linalg.norm(x) < 0.1:  # the body points straight up: any heading will do
            x = np.array([0.0, 1.0, 0.0]) - z[1] * z
        x /= np.linalg.norm(x)
        return np.stack([x, np.cross(z, x), z])

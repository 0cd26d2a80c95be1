"""How a map begins: level, at rest, or with two views from a robot in motion."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from airground.core.messages import RobotCalibration
from airground.core.se3 import SE3
from airground.slam.inertial.preintegration import GRAVITY
from airground.slam.frame import Frame
from airground.slam.inertial.stationarity import at_rest
from airground.slam.motion_model import MotionModel
from airground.slam.rig_state import RigState

REST_WINDOW_NS = 400_000_000
LEVEL_WINDOW_NS = 200_000_000
MAX_OFF_GRAVITY = 0.5
"""Specific force may differ this much from gravity for its direction to be upwards [m/s^2]."""


def level_start(
    motion: MotionModel, calibration: RobotCalibration, stamp_ns: int
) -> tuple[RigState, bool]:
    """The state in which a map begins: camera in the origin, its x axis along the map's.

    Up is where the accelerometer says; without one, where it is if the body stands level.

    Returns:
        The state, and whether it is known that the robot stands still.
    """
    up = calibration.T_body_imu.rotation.T[:, 2]
    if motion.buffer is not None:
        means = motion.buffer.mean_between(stamp_ns - LEVEL_WINDOW_NS, stamp_ns)
        if means is not None and abs(np.linalg.norm(means[1]) - GRAVITY) < MAX_OFF_GRAVITY:
            up = means[1]
    return centred(RigState.at_origin(upright(up, calibration)), calibration), False


def upright(up_rig: NDArray[np.float64], calibration: RobotCalibration) -> NDArray[np.float64]:
    """(3, 3) `R_map_rig` with z along `up_rig` and the camera's x axis over the map's."""
    z = up_rig / np.linalg.norm(up_rig)
    right = calibration.T_imu_camera.rotation[:, 0]
    x = right - (right @ z) * z
    x /= np.linalg.norm(x)
    return np.stack([x, np.cross(z, x), z])


def centred(state: RigState, calibration: RobotCalibration) -> RigState:
    """`state`, shifted so that the camera is in the map's origin."""
    return replace(state, position=-state.rotation @ calibration.T_imu_camera.translation)


class RestStart:
    """Waits beside a robot at rest until it begins to move.

    Args:
        calibration: Of the robot.
    """

    def __init__(self, calibration: RobotCalibration) -> None:
        self._calibration = calibration
        self._last: tuple[Frame, RigState] | None = None

    def observe(self, frame: Frame, motion: MotionModel) -> tuple[Frame, RigState] | None:
        """Take in the next image; once the robot moved, the last image and state at rest."""
        if motion.buffer is None:
            return None
        rest = at_rest(motion.buffer, frame.stamp_ns - REST_WINDOW_NS, frame.stamp_ns)
        if rest is None:
            last, self._last = self._last, None
            return last
        state = RigState.at_origin(upright(rest.specific_force, self._calibration))
        excess = np.linalg.norm(rest.specific_force) - GRAVITY
        bias = excess * rest.specific_force / np.linalg.norm(rest.specific_force)
        state = replace(state, gyro_bias=rest.gyro, accelerometer_bias=bias)
        self._last = frame, centred(state, self._calibration)
        return None

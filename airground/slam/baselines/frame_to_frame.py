"""RGB-D odometry from each frame to the one before, with any aligner.

Without map, keyframes and correction, errors add up; SLAM's gain is measured against this.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np

from airground.core.messages import GroundImage, ImuSamples, RobotCalibration
from airground.core.se3 import SE3, nearest_rotation
from airground.core.trajectory import Trajectory
from airground.slam.front_end import PoseLog, TrackedPose, Tracking

MIN_DEPTH_SHARE = 0.05
"""A frame with depth in fewer of its pixels cannot be aligned."""
MIN_CONTRAST = 3.0
"""Standard deviation of grey levels below which a frame is dark or the lens is covered."""
MAX_SPEED_MPS = 3.0
MAX_TURN_DPS = 360.0
"""No robot here moves faster; an alignment that says so has failed."""
MAX_GAP_S = 1.0
"""After this time without an alignment the frames do not overlap: a bridge would be a guess."""
GRAVITY_MPS2 = 9.81
REST_TOLERANCE_MPS2 = 0.5
"""Largest difference from gravity at which an accelerometer gives its direction [m/s^2]."""


class Aligner(Protocol):
    """Finds how the camera moved between two frames."""

    def align(self, previous: GroundImage, image: GroundImage) -> SE3 | None:
        """`T_previous_image`, or None where the frames cannot be aligned."""


class FrameToFrame:
    """A front end for the ground robot that chains the motions between frames. A frame that cannot
    be aligned is lost; the next is aligned with the last good one for up to a second, and after
    that tracking stays lost, as there is no map."""

    def __init__(self, calibration: RobotCalibration, aligner: Aligner) -> None:
        self._start = LevelStart(calibration)
        self._aligner = aligner
        self._previous: tuple[GroundImage, SE3] | None = None
        self._log = PoseLog()

    def add_imu(self, samples: ImuSamples) -> None:
        """Use the samples before the first pose to find the direction of gravity."""
        if self._previous is None:
            self._start.add_imu(samples)

    def track(self, image: GroundImage) -> TrackedPose:
        """The last pose and the motion since."""
        if not _can_be_aligned(image):
            lost = Tracking.INITIALIZING if self._previous is None else Tracking.LOST
            waiting = "an image with contrast and depth" if self._previous is None else ""
            return TrackedPose(image.stamp_ns, lost, None, waiting=waiting)
        if self._previous is None:
            T_map_camera = self._start.T_map_camera()
        else:
            previous, T_map_previous = self._previous
            T_previous_image = self._motion(previous, image)
            if T_previous_image is None:
                return TrackedPose(image.stamp_ns, Tracking.LOST, None)
            T_map_camera = T_map_previous @ T_previous_image
        self._previous = image, T_map_camera
        return self._log.tracked(image.stamp_ns, T_map_camera)

    def finish(self) -> None:
        """Nothing was put off."""

    def trajectory(self) -> Trajectory | None:
        """The poses as they were returned."""
        return self._log.trajectory()

    def _motion(self, previous: GroundImage, image: GroundImage) -> SE3 | None:
        duration_s = (image.stamp_ns - previous.stamp_ns) / 1e9
        if duration_s > MAX_GAP_S:
            return None
        motion = self._aligner.align(previous, image)
        if motion is None:
            return None
        too_far = np.linalg.norm(motion.translation) > MAX_SPEED_MPS * duration_s
        too_much = np.rad2deg(motion.angle()) > MAX_TURN_DPS * duration_s
        return None if too_far or too_much else motion


def _can_be_aligned(image: GroundImage) -> bool:
    contrast = float(image.colour[::4, ::4, 1].std())
    return contrast >= MIN_CONTRAST and bool(np.isfinite(image.depth).mean() >= MIN_DEPTH_SHARE)


class LevelStart:
    """Makes z of a map point up: by the accelerometer where it reads gravity and nothing else,
    otherwise by a body taken to be level and the camera's mounting in it."""

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

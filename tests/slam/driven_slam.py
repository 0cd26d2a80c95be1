"""Keyframe SLAM with its poses and points from a known motion in place of images.

What is left of the engine is what comes after vision: scale, vertical and the map's motion.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from airground.config import MonocularSlam
from airground.core.messages import ImuNoise, ImuSamples, RobotCalibration
from airground.core.se3 import SE3
from airground.slam.keyframe_slam import KeyframeSlam
from airground.slam.rig_state import RigState
from airground.slam.sparse_map import Keyframe
from tests.slam.inertial_keyframes import T_RIG_CAMERA, UNIT_M
from tests.slam.inertial_motion import ADIS16448, Motion, read_imu, to_ns
from tests.slam.views import CAMERA

CALIBRATION = RobotCalibration(CAMERA, T_RIG_CAMERA, SE3.identity(), ADIS16448)
IMAGE_S, KEYFRAME_EVERY = 0.05, 7
SIGMA_PX = 0.3
CENTRE_SIGMA_M = SIGMA_PX / CAMERA.fx * UNIT_M
NOTHING = np.empty((0, 2))


class DrivenSlam:
    """The engine after `seconds` of a motion, image by image.

    The visual map has any attitude and a unit of 2.5 m; every seventh image is a keyframe. The
    calibration states `imu`; the samples are those of an ADIS16448.

    Attributes:
        slam: The engine.
        R_v_world: (3, 3) attitude of the visual map.
    """

    def __init__(
        self, motion: Motion, seconds: float, seed: int = 0, imu: ImuNoise = ADIS16448
    ) -> None:
        self._rng = np.random.default_rng(seed)
        self._motion = motion
        self.slam = KeyframeSlam(replace(CALIBRATION, imu=imu), MonocularSlam(), self._rng)
        samples = read_imu(motion, seconds + 0.5, self._rng).samples
        self._samples = samples
        self.R_v_world = SE3.from_rotation_vector(self._rng.normal(0, 1.0, 3)).rotation
        low, high = (-2.5, -2.5, -2.4), (2.5, 2.5, -1.8)
        self._points = self._rng.uniform(low, high, (300, 3))
        slam_map = self.slam.map
        ids = slam_map.new_points(np.zeros((300, 2)), 0)
        slam_map.place(ids, self._points @ self.R_v_world.T / UNIT_M)
        self.times = np.arange(0, seconds, IMAGE_S)

    def samples_lost(self, start_s: float, end_s: float) -> None:
        """The IMU said nothing between two times."""
        stamps = self._samples.stamps_ns
        kept = (stamps < to_ns(np.array(start_s))) | (stamps > to_ns(np.array(end_s)))
        self._samples = ImuSamples(
            stamps[kept], self._samples.gyro[kept], self._samples.accelerometer[kept]
        )

    def image(self, index: int) -> None:
        """Go on to the next image: its visual pose, and a keyframe now and then."""
        slam, t = self.slam, self.times[index : index + 1]
        stamp_ns = int(to_ns(t)[0])
        if index == 0:
            slam.motion.add(self._samples)
        R = self._motion.rotations(t)[0]
        centre = self.centres(t)[0] + self._rng.normal(0, CENTRE_SIGMA_M, 3)
        R_v_rig = self.R_v_world @ R
        position = self.R_v_world @ centre / UNIT_M - R_v_rig @ T_RIG_CAMERA.translation
        slam.state = replace(RigState.at_origin(R_v_rig), position=position)
        slam.stamp_ns = stamp_ns
        if index % KEYFRAME_EVERY == 0:
            self._keyframe(SE3(R, centre - R @ T_RIG_CAMERA.translation) @ T_RIG_CAMERA)

    def _keyframe(self, T_world_camera: SE3) -> None:
        slam = self.slam
        assert slam.stamp_ns is not None
        keyframes = slam.map.keyframes
        if keyframes:
            motion = slam.motion.preintegrate(
                keyframes[-1].stamp_ns, slam.stamp_ns, RigState.at_origin()
            )
            if motion is not None:
                slam.adjuster.motions[len(keyframes)] = motion
        pixels = CAMERA.project(T_world_camera.inverse() @ self._points)
        pixels = pixels + self._rng.normal(0, SIGMA_PX, pixels.shape)
        with np.errstate(invalid="ignore"):
            seen = ((pixels > 0) & (pixels < (CAMERA.width, CAMERA.height))).all(axis=1)
        keyframe = Keyframe(
            slam.stamp_ns,
            np.zeros((4, 4), np.uint8),
            slam.state,
            np.flatnonzero(seen),
            pixels[seen],
            np.full(int(seen.sum()), np.nan),
        )
        keyframes.append(keyframe)

    def centres(self, t: NDArray) -> NDArray[np.float64]:
        """(N, 3) true places of the camera in the world [m]."""
        return self._motion.position(t) + self._motion.rotations(t) @ T_RIG_CAMERA.translation

    def scale_error(self) -> float:
        """By how much keyframes are farther apart than in truth, as a share."""
        keyframes = self.slam.map.keyframes
        t = np.array([k.stamp_ns for k in keyframes]) * 1e-9 - 1.0
        here = np.array([(k.state.pose() @ T_RIG_CAMERA).translation for k in keyframes])
        true = self.centres(t)
        spread = [np.linalg.norm(x - x.mean(axis=0)) for x in (here, true)]
        return float(spread[0] / spread[1] - 1.0)

    def tilt(self) -> float:
        """Angle between the map's z axis and the true vertical [rad]."""
        newest = self.slam.map.keyframes[-1]
        true = self._motion.rotations(np.array([newest.stamp_ns * 1e-9 - 1.0]))[0]
        up = newest.state.rotation @ true.T @ [0.0, 0.0, 1.0]
        return float(np.arccos(min(1.0, up[2])))

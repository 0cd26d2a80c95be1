"""RGB-D SLAM of the ground robot (Sec. IV): the monocular machinery with measured depth."""

from __future__ import annotations

import cv2
import numpy as np

from airground.config import Config
from airground.core.blas_threads import one_blas_thread
from airground.core.messages import GroundImage, ImuSamples, RobotCalibration
from airground.core.trajectory import Trajectory
from airground.slam.frame import Frame, require_order
from airground.slam.front_end import TrackedPose, Tracking
from airground.slam.keyframe_slam import KeyframeSlam
from airground.slam.known_vertical import KnownVertical
from airground.slam.stale_images import StaleImages
from airground.slam.starts import StandStill, level_start

HAND_HELD = 1.5
"""Factor on the corners' standard deviation without an IMU: the camera is then hand-held, and turns
while its rows are read out."""
MIN_FIRST_POINTS = 40
"""Least number of corners with depth in a map's first image."""


class RgbdSlam:
    """A front end of the ground robot, with the section `rgbd_slam` of the configuration.

    Depth puts corners into the map at once, so tracking begins with the first image that
    shows something, also while the camera only turns.
    """

    def __init__(
        self, calibration: RobotCalibration, config: Config, rng: np.random.Generator
    ) -> None:
        parameters = config.rgbd_slam
        if calibration.imu is None:
            sigma_px = HAND_HELD * parameters.corner_sigma_px
            parameters = parameters.model_copy(update={"corner_sigma_px": sigma_px})
        self._slam = KeyframeSlam(
            calibration, parameters, rng, parameters.depth_noise_per_m, parameters.max_depth_m
        )
        self._slam.metric = True
        self._standing = StandStill(calibration)
        self._vertical = KnownVertical(calibration.imu)
        self._most_points = 0
        self._images = StaleImages(self._slam)
        self._last_ns: int | None = None

    def add_imu(self, samples: ImuSamples) -> None:
        """Take the inertial measurements up to the next image."""
        self._slam.motion.add(samples)

    @one_blas_thread()
    def track(self, image: GroundImage) -> TrackedPose:
        """The pose of the camera at `image`."""
        require_order(image.stamp_ns, self._last_ns)
        self._last_ns = image.stamp_ns
        grey = cv2.cvtColor(image.colour, cv2.COLOR_RGB2GRAY).astype(np.uint8, copy=False)
        frame = Frame(image.stamp_ns, grey, image.depth)
        slam = self._slam
        if not slam.begun:
            return self._begin(frame)
        fit, corrected = self._images.track(frame)
        if fit is None:
            return TrackedPose(image.stamp_ns, Tracking.LOST, None)
        if not slam.inertial:
            rest = self._standing.observe(image.stamp_ns, slam.state.position, slam.motion)
            if rest is not None:
                slam.stand_still(frame, rest)
                corrected = True
        slam.note(image.stamp_ns)
        self._vertical.read(image.stamp_ns, slam.state.rotation)
        level_sigma = self._vertical.sigma if slam.inertial else self._vertical.sigma_at_start
        return TrackedPose(
            image.stamp_ns,
            Tracking.TRACKED,
            slam.T_map_camera(),
            covariance=slam.covariance(fit, slam.calibration.sigmas.depth_scale, level_sigma),
            depth_range=slam.depth_range(),
            corrected=corrected,
            corners=slam.corners(),
        )

    @one_blas_thread()
    def finish(self) -> None:
        """Adjust the whole map."""
        if self._slam.begun:
            self._slam.adjust_all()

    def trajectory(self) -> Trajectory | None:
        """The newest poses of all images tracked so far."""
        return self._slam.trajectory()

    def _begin(self, frame: Frame) -> TrackedPose:
        slam = self._slam
        state = level_start(slam.motion, slam.calibration, frame.stamp_ns)
        slam.begin(frame, state)
        points = int(slam.map.mapped(slam.tracker.ids).sum())
        if points < MIN_FIRST_POINTS:
            slam.reset()
            self._most_points = max(self._most_points, points)
            waiting = (
                f"an image with {MIN_FIRST_POINTS} corners that have depth: at most "
                f"{self._most_points} so far"
            )
            return TrackedPose(frame.stamp_ns, Tracking.INITIALIZING, None, waiting=waiting)
        slam.published = slam.settled = True
        slam.note(frame.stamp_ns)
        self._vertical.read(frame.stamp_ns, slam.state.rotation)
        return TrackedPose(frame.stamp_ns, Tracking.TRACKED, slam.T_map_camera())

"""The start of a map: level, at rest, or with two views from a robot in motion."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass, replace

import numpy as np

from airground.config import KeyframeSlam
from airground.core.arrays import F64
from airground.core.messages import RobotCalibration
from airground.slam.corners import detect_corners
from airground.slam.feature_tracker import FeatureTracker
from airground.slam.frame import Frame
from airground.slam.geometry.two_view import TwoViewStart, start_from_two_views
from airground.slam.inertial.preintegration import GRAVITY
from airground.slam.inertial.stationarity import Rest, at_rest, gravity_aligned
from airground.slam.motion_model import MotionModel
from airground.slam.rig_state import RigState

REST_WINDOW_NS = 500_000_000
REST_FRAMES = 6
"""A slow beginning hides in the noise at first: the map begins this many images earlier."""
STANDING_M = 0.005
"""A robot whose camera stays within this [m] for a while stands still, if its IMU says so."""
START_LEVELS = 3
MIN_CORNERS = 60
MIN_LEFT = 0.5
"""With fewer of its corners left than this share, another first view is chosen."""
MOST_PASSED_OVER = 5
"""Where images show hardly a corner, one after the other, as on the floor before take-off, more
and more of them are passed over before corners are sought again, up to so many."""
GYRO_START_SIGMA = 0.01
"""A gyro's unknown bias turns this far in a second [rad]."""
LEVEL_WINDOW_NS = 200_000_000
MAX_OFF_GRAVITY = 0.5
"""Specific force may differ this much from gravity for its direction to be upwards [m/s^2]."""


def level_start(motion: MotionModel, calibration: RobotCalibration, stamp_ns: int) -> RigState:
    """The state in which a map begins: camera in the origin, its x axis along the map's. Up is by
    the accelerometer; without one, the body is taken to stand level."""
    up = calibration.T_body_imu.rotation.T[:, 2]
    if motion.buffer is not None:
        now = motion.imu_time(stamp_ns)
        means = motion.buffer.mean_between(now - LEVEL_WINDOW_NS, now)
        if means is not None and abs(np.linalg.norm(means[1]) - GRAVITY) < MAX_OFF_GRAVITY:
            up = means[1]
    rotation = gravity_aligned(up, calibration.T_imu_camera.rotation[:, 0])
    return _centred(RigState.at_origin(rotation), calibration)


def _centred(state: RigState, calibration: RobotCalibration) -> RigState:
    """`state`, shifted so that the camera is in the map's origin."""
    return replace(state, position=-state.rotation @ calibration.T_imu_camera.translation)


class StandStill:
    """Notices that a tracked robot stands still, so that its velocity and its biases are known."""

    def __init__(self, calibration: RobotCalibration) -> None:
        self._noise = calibration.imu
        self._came_ns = 0
        self._place = np.full(3, np.inf)

    def observe(self, stamp_ns: int, position: F64, motion: MotionModel) -> Rest | None:
        """What the IMU read, if the robot stood at this place for `REST_WINDOW_NS` by now."""
        if motion.buffer is None or self._noise is None:
            return None
        if math.dist(self._place, position) > STANDING_M:
            self._came_ns, self._place = stamp_ns, position
        now = motion.imu_time(stamp_ns)
        known = motion.buffer.covers(now - REST_WINDOW_NS, now)
        if stamp_ns - self._came_ns < REST_WINDOW_NS or not known:
            return None
        return at_rest(motion.buffer.between(now - REST_WINDOW_NS, now), self._noise)


class RestStart:
    """Waits beside a robot at rest until it begins to move."""

    def __init__(self, calibration: RobotCalibration) -> None:
        self._calibration = calibration
        self._resting: deque[tuple[Frame, RigState]] = deque(maxlen=REST_FRAMES)

    @property
    def resting(self) -> bool:
        """Whether the robot rested at the newest image."""
        return bool(self._resting)

    def observe(self, frame: Frame, motion: MotionModel) -> tuple[Frame, RigState] | None:
        """Take in the next image; once the robot moved, an image and the state at rest."""
        noise = self._calibration.imu
        if motion.buffer is None or noise is None:
            return None
        now = motion.imu_time(frame.stamp_ns)
        samples = motion.buffer.between(now - REST_WINDOW_NS, now)
        rest = at_rest(samples, noise)
        if rest is None:
            began = self._resting[0] if self._resting else None
            self._resting.clear()
            return began
        rotation = gravity_aligned(
            rest.specific_force, self._calibration.T_imu_camera.rotation[:, 0]
        )
        state = RigState.at_origin(rotation).standing(rest)
        self._resting.append((frame, _centred(state, self._calibration)))
        return None


@dataclass(frozen=True, eq=False)
class MovingStart:
    """Two views of a robot in motion and the points that they share.

    Attributes:
        first, second: The images.
        first_state, second_state: States of the rig, in units of the first view's median depth.
        pixels_first, pixels_second: (n, 2) pixels of the points.
        points_map: (n, 3) points in the map.
    """

    first: Frame
    second: Frame
    first_state: RigState
    second_state: RigState
    pixels_first: F64
    pixels_second: F64
    points_map: F64

    def views(self) -> tuple[tuple[Frame, RigState, F64], ...]:
        """Image, state and pixels of both."""
        return (
            (self.first, self.first_state, self.pixels_first),
            (self.second, self.second_state, self.pixels_second),
        )

    def biased(self, known: RigState) -> MovingStart:
        """The same start with the biases of another state."""
        biases = {
            "gyro_bias": known.gyro_bias,
            "accelerometer_bias": known.accelerometer_bias,
        }
        return replace(
            self,
            first_state=replace(self.first_state, **biases),
            second_state=replace(self.second_state, **biases),
        )


class TwoViewWait:
    """Follows corners from one image until another sees enough of them from elsewhere."""

    def __init__(
        self, calibration: RobotCalibration, parameters: KeyframeSlam, rng: np.random.Generator
    ) -> None:
        self._calibration, self._parameters = calibration, parameters
        self._tracker = FeatureTracker(parameters.patch_px, START_LEVELS)
        self._rng = rng
        self._first: Frame | None = None
        self._corners = np.empty((0, 2), np.float32)
        self._blind = self._pass_over = 0

    def observe(self, frame: Frame, motion: MotionModel) -> MovingStart | None:
        """Take in the next image; the start, once there is one."""
        if self._pass_over:
            self._pass_over -= 1
            return None
        self._tracker.advance(frame.image, self._tracker.pixels)
        few = len(self._tracker.ids) < MIN_LEFT * max(len(self._corners), MIN_CORNERS)
        if self._first is None or few:
            self._restart(frame)
            return None
        before = self._corners[self._tracker.ids].astype(np.float64)
        here = self._tracker.pixels.astype(np.float64)
        camera = self._calibration.camera
        R_rig = self._turn(motion, self._first, frame)
        R = self._calibration.T_imu_camera.rotation
        start = start_from_two_views(
            before,
            here,
            camera,
            self._rng,
            R_a_b=None if R_rig is None else R.T @ R_rig @ R,
            rotation_sigma=GYRO_START_SIGMA,
            sigma_px=self._parameters.corner_sigma_px,
        )
        if not start.good or start.T_a_b is None:
            return None
        return self._made(self._first, frame, start, before, here, motion)

    def waiting(self) -> str:
        """What is waited for and how far it got, in words."""
        seen, needed = len(self._corners), round(MIN_LEFT * MIN_CORNERS)
        if seen < needed:
            return f"a first view with corners: {seen} in the newest, {needed} are needed"
        ids = self._tracker.ids
        moved_px = np.linalg.norm(self._tracker.pixels - self._corners[ids], axis=1)
        return (
            f"a second view from elsewhere: {len(ids)} of {seen} corners are still followed, "
            f"median motion {np.median(moved_px) if len(ids) else 0.0:.1f} px"
        )

    def _restart(self, frame: Frame) -> None:
        self._tracker.clear()
        self._tracker.advance(frame.image, self._tracker.pixels)
        self._corners = detect_corners(
            frame.image,
            self._tracker.pixels,
            self._parameters.corners,
            self._parameters.corner_spacing_px,
        )
        self._tracker.add(np.arange(len(self._corners)), self._corners)
        self._first = frame
        blind = len(self._corners) < MIN_LEFT * MIN_CORNERS
        self._blind = self._blind + 1 if blind else 0
        self._pass_over = min(max(self._blind - 1, 0), MOST_PASSED_OVER)

    def _turn(self, motion: MotionModel, first: Frame, second: Frame) -> F64 | None:
        """(3, 3) turn of the rig between two images, by the gyro."""
        moved = motion.preintegrate(first.stamp_ns, second.stamp_ns, RigState.at_origin())
        return None if moved is None else moved.rotation

    def _made(
        self,
        first: Frame,
        second: Frame,
        start: TwoViewStart,
        before: F64,
        here: F64,
        motion: MotionModel,
    ) -> MovingStart:
        assert start.T_a_b is not None
        state = level_start(motion, self._calibration, first.stamp_ns)
        T_rig_camera = self._calibration.T_imu_camera
        T_map_first = state.pose() @ T_rig_camera
        T_map_second = T_map_first @ start.T_a_b @ T_rig_camera.inverse()
        good = start.inliers
        return MovingStart(
            first,
            second,
            state,
            state.posed(T_map_second),
            before[good],
            here[good],
            T_map_first @ start.points_a[good],
        )

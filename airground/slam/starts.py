"""The start of a map: level, or with two views from a robot in motion, perhaps after a rest."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass, replace

import numpy as np
from numpy.linalg import norm

from airground.config import KeyframeSlam
from airground.core.arrays import F32, F64, I64
from airground.core.messages import RobotCalibration
from airground.core.se3 import SE3
from airground.slam.corners import detect_corners
from airground.slam.feature_tracker import FeatureTracker
from airground.slam.frame import Frame
from airground.slam.geometry.pose_estimation import estimate_pose
from airground.slam.geometry.two_view import TwoViewStart, start_from_two_views
from airground.slam.inertial.preintegration import GRAVITY
from airground.slam.inertial.stationarity import Rest, at_rest, gravity_aligned
from airground.slam.motion_model import MotionModel
from airground.slam.rig_state import RigState

REST_WINDOW_NS = 500_000_000
REST_FRAMES = 6
"""A slow beginning hides in the noise at first: what the IMU read counts as of this many images
earlier."""
RESTING_VIEW_NS = 500_000_000
"""While the robot rests, its first view is chosen anew so often [ns]: inertial motion from there
is short."""
MOST_BETWEEN = 300
"""Images after the first view that get a pose once the map begins: ten seconds at 30 Hz."""
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


def level_start(
    motion: MotionModel, calibration: RobotCalibration, stamp_ns: int, flying: bool = False
) -> RigState:
    """The state in which a map begins: camera in the origin, its x axis along the map's. Up is by
    the accelerometer; without one, or where a push hides gravity from one on the ground, the body
    is taken to stand level."""
    up = calibration.T_body_imu.rotation.T[:, 2]
    if motion.buffer is not None:
        now = motion.imu_time(stamp_ns)
        means = motion.buffer.mean_between(now - LEVEL_WINDOW_NS, now)
        # Rotors push along the body's own axis; the map is turned upright later.
        if means is not None and (flying or abs(norm(means[1]) - GRAVITY) < MAX_OFF_GRAVITY):
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
    """What the IMU read while the robot rested before it began to move."""

    def __init__(self, calibration: RobotCalibration) -> None:
        self._noise = calibration.imu
        self._window: deque[Rest] = deque(maxlen=REST_FRAMES)
        self.rest: Rest | None = None
        """Readings of the last rest that ended; None before."""

    @property
    def resting(self) -> bool:
        """Whether the robot rested at the newest image."""
        return bool(self._window)

    def observe(self, frame: Frame, motion: MotionModel) -> None:
        """Take in the next image."""
        if motion.buffer is None or self._noise is None:
            return
        now = motion.imu_time(frame.stamp_ns)
        rest = at_rest(motion.buffer.between(now - REST_WINDOW_NS, now), self._noise)
        if rest is not None:
            self._window.append(rest)
        elif self._window:
            self.rest = self._window[0]
            self._window.clear()


@dataclass(frozen=True, eq=False)
class MovingStart:
    """Two views of a robot in motion and the points that they share.

    Attributes:
        first, second: The images.
        first_state, second_state: States of the rig, in units of the first view's median depth.
        pixels_first, pixels_second: (n, 2) pixels of the points.
        points_map: (n, 3) points in the map.
        views_before: Stamp [ns] and pose `T_map_camera` of the images before the second view, the
            first view among them, in order of time.
    """

    first: Frame
    second: Frame
    first_state: RigState
    second_state: RigState
    pixels_first: F64
    pixels_second: F64
    points_map: F64
    views_before: tuple[tuple[int, SE3], ...] = ()

    def views(self) -> tuple[tuple[Frame, RigState, F64], ...]:
        """Image, state and pixels of both."""
        return (
            (self.first, self.first_state, self.pixels_first),
            (self.second, self.second_state, self.pixels_second),
        )

    def biased(self, rest: Rest) -> MovingStart:
        """The same start with the biases that the IMU showed at rest."""
        biases = {
            "gyro_bias": rest.gyro,
            "accelerometer_bias": rest.accelerometer_bias,
        }
        return replace(
            self,
            first_state=replace(self.first_state, **biases),
            second_state=replace(self.second_state, **biases),
        )


@dataclass(frozen=True, eq=False)
class _View:
    """Corners of the first view in a later image: their numbers (n,) and pixels (n, 2)."""

    stamp_ns: int
    ids: I64
    pixels: F32


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
        self._rested_ns: list[int] = []
        self._between: deque[_View] = deque(maxlen=MOST_BETWEEN)

    def observe(
        self, frame: Frame, motion: MotionModel, resting: bool = False
    ) -> MovingStart | None:
        """Take in the next image, of a robot at rest or not; the start, once there is one."""
        if self._pass_over:
            self._pass_over -= 1
            return None
        self._tracker.advance(frame.image, self._tracker.pixels)
        few = len(self._tracker.ids) < MIN_LEFT * max(len(self._corners), MIN_CORNERS)
        if self._first is None or few:
            self._rested_ns.clear()
            self._restart(frame)
            return None
        if resting and frame.stamp_ns - self._first.stamp_ns >= RESTING_VIEW_NS:
            self._rested_ns += [self._first.stamp_ns, *(view.stamp_ns for view in self._between)]
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
            ids, pixels = self._tracker.ids.copy(), self._tracker.pixels.copy()
            self._between.append(_View(frame.stamp_ns, ids, pixels))
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
        self._between.clear()
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
        state = level_start(motion, self._calibration, first.stamp_ns, flying=True)
        T_rig_camera = self._calibration.T_imu_camera
        T_map_first = state.pose() @ T_rig_camera
        T_map_second = T_map_first @ start.T_a_b @ T_rig_camera.inverse()
        good = start.inliers
        points = T_map_first @ start.points_a[good]
        placed = np.full((len(self._corners), 3), np.nan)
        placed[self._tracker.ids[good]] = points
        rested = [(stamp_ns, T_map_first) for stamp_ns in self._rested_ns]
        return MovingStart(
            first,
            second,
            state,
            state.posed(T_map_second),
            before[good],
            here[good],
            points,
            (*rested, (first.stamp_ns, T_map_first), *self._placed_views(placed, T_map_first)),
        )

    def _placed_views(self, points_map: F64, T_map_camera: SE3) -> list[tuple[int, SE3]]:
        """Stamps and poses of the images since the first view, which has this pose, by the (n, 3)
        places of its corners; NaN for a corner without one."""
        placed = []
        for view in self._between:
            points = points_map[view.ids]
            known = np.isfinite(points[:, 0])
            fit = estimate_pose(
                points[known],
                view.pixels[known].astype(np.float64),
                np.full(int(known.sum()), self._parameters.corner_sigma_px),
                self._calibration.camera,
                T_map_camera,
            )
            if fit.inliers.sum() >= self._parameters.min_points:
                T_map_camera = fit.T_map_camera
                placed.append((view.stamp_ns, T_map_camera))
        return placed

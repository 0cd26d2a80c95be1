"""Keyframe-based SLAM of one camera, with depth, an IMU, both or neither (Sec. IV).

Corners are followed from image to image; those that are in the map give the pose; now and
then an image becomes a keyframe and extends the map. How a map begins is in `starts.py`.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from airground.config import KeyframeSlam as Parameters
from airground.core.messages import ImuSamples, RobotCalibration
from airground.core.se3 import SE3
from airground.core.trajectory import Trajectory
from airground.slam import so3
from airground.slam.depth_lookup import inverse_depths_at
from airground.slam.expected_pixels import expected_pixels
from airground.slam.feature_tracker import FeatureTracker
from airground.slam.frame import Frame
from airground.slam.frame_pose import frame_pose
from airground.slam.geometry.pose_estimation import PoseFit
from airground.slam.image_turn import ImageTurn
from airground.slam.inertial.alignment import InertialAlignment
from airground.slam.keyframe_choice import what_is_new
from airground.slam.local_mapping import LocalMapper, NewKeyframe
from airground.slam.map_adjustment import MapAdjuster
from airground.slam.motion_model import MotionModel, Prediction
from airground.slam.recovery import Recovery
from airground.slam.rig_state import RigState
from airground.slam.sparse_map import SparseMap
from airground.slam.starts import MovingStart

PATIENCE = 2
"""A point that fits the pose badly in this many images in a row is given up."""
GUIDED_LEVELS, UNGUIDED_LEVELS = 1, 3
"""Pyramid levels above the image: a gyro tells where corners go, constant motion guesses."""
MAX_COAST_S = 3.0
"""Inertial dead reckoning without a look at the scene drifts by centimetres in this time."""
FIRST_GLOBAL_ADJUSTMENT = 8
"""The whole map is adjusted at this many keyframes, and whenever it has grown by half: what
the beginning got wrong shows only later, and would bend all that stands on it."""
GLOBAL_ADJUSTMENT_GROWTH = 1.3
MAX_JUMP_M = 0.25
"""No robot here moves so far between prediction and measurement from image to image."""
DEPTH_RANGE_PERCENT = 2.0


class KeyframeSlam:
    """The machinery that both robots share.

    Args:
        calibration: Of the robot.
        parameters: Its section of the configuration.
        rng: Draws samples wherever outliers are to be told.
        inverse_depth_sigma: Noise of measured inverse depth [1/m].
        max_depth_m: Depth beyond this starts no point.

    Attributes:
        map: Keyframes and points.
        tracker: The corners that are followed.
        motion: Predicts the next state.
        state: The newest.
        stamp_ns: Of the newest state; None before the map began.
        inertial: Whether the map is metric and gravity-aligned and the velocity known, so
            that the accelerometer counts.
        metric: Whether the map's unit is the metre.
    """

    def __init__(
        self,
        calibration: RobotCalibration,
        parameters: Parameters,
        rng: np.random.Generator,
        inverse_depth_sigma: float = 1.0,
        max_depth_m: float = np.inf,
    ) -> None:
        self.calibration, self.parameters = calibration, parameters
        self.camera, self.T_rig_camera = calibration.camera, calibration.T_imu_camera
        self.motion = MotionModel(calibration.imu, calibration.camera_time_offset_ns)
        levels = GUIDED_LEVELS if calibration.imu is not None else UNGUIDED_LEVELS
        self.tracker = FeatureTracker(parameters.patch_px, levels)
        self._image_turn = ImageTurn(self.camera) if calibration.imu is None else None
        self.metric = self.inertial = False
        self._inverse_depth_sigma, self._max_depth_m = inverse_depth_sigma, max_depth_m
        self._rng = rng
        self._tracked: list[tuple[int, int, SE3]] = []
        self.reset()

    def reset(self) -> None:
        """Forget the map; images that were tracked in it are given up."""
        self.map = SparseMap()
        self.tracker.clear()
        self.state = RigState.at_origin()
        self.stamp_ns: int | None = None
        self._turn = np.eye(3)
        self._seen_ns = 0
        self._next_global = FIRST_GLOBAL_ADJUSTMENT
        self._keyframe_covariance = np.zeros((6, 6))
        self._tracked.clear()
        self.adjuster = MapAdjuster(
            self.map, self.camera, self.T_rig_camera, self.parameters, self._inverse_depth_sigma
        )
        self._mapper = LocalMapper(
            self.map,
            self.tracker,
            self.adjuster,
            self.camera,
            self.T_rig_camera,
            self.parameters,
            self._max_depth_m,
        )
        self._recovery = Recovery(self.map, self.camera, self.T_rig_camera, self.parameters)

    def add_imu(self, samples: ImuSamples) -> None:
        self.motion.add(samples)

    @property
    def begun(self) -> bool:
        """Whether there is a map to track in."""
        return self.stamp_ns is not None

    def begin(self, frame: Frame, state: RigState, still: bool) -> None:
        """Start the map with this image as its first keyframe."""
        self.tracker.clear()
        self.tracker.advance(frame.image, self.tracker.pixels)
        self.state, self.stamp_ns, self._seen_ns = state, frame.stamp_ns, frame.stamp_ns
        self._insert(frame, still=still)

    def begin_moving(self, start: MovingStart) -> None:
        """Start the map with two views; its unit is the first one's median depth."""
        self.tracker.clear()
        self.tracker.advance(start.first.image, self.tracker.pixels)
        ids = self.map.new_points(start.pixels_first, 0)
        self.map.place(ids, start.points_map)
        self.tracker.add(ids, start.pixels_first)
        self.state, self.stamp_ns = start.first_state, start.first.stamp_ns
        self._insert(start.first)
        self.tracker.clear()
        self.tracker.advance(start.second.image, self.tracker.pixels)
        self.tracker.add(ids, start.pixels_second)
        self.state, self.stamp_ns = start.second_state, start.second.stamp_ns
        self._seen_ns = start.second.stamp_ns
        self._insert(start.second)

    def track(self, frame: Frame) -> tuple[PoseFit | None, bool]:
        """Follow the map into the next image.

        Returns:
            The fit of the newest pose, None where the image did not give one; and whether
            the map was adjusted as a whole.
        """
        assert self.stamp_ns is not None
        turn = self._guessed_turn(frame)
        prediction = self.motion.predict(
            self.state, turn, self.stamp_ns, frame.stamp_ns, self.inertial
        )
        lost = self._seen_ns != self.stamp_ns
        there = prediction.state.pose() @ self.T_rig_camera
        expected = expected_pixels(self.map, self.tracker, self.camera, self.T_map_camera(), there)
        self.tracker.advance(frame.image, expected, 2 if lost else 0)
        fit = self._fit(frame, prediction)
        if fit is None:
            fit = self._recover(frame, prediction)
        self._move_on(frame, prediction, fit)
        if fit is None and not (prediction.inertial and not self._tracked):
            return None, False
        if self._wants_keyframe():
            return fit, self._insert(frame)
        return fit, False

    def note(self, stamp_ns: int) -> None:
        """Remember the newest pose as one of the trajectory."""
        index = len(self.map.keyframes) - 1
        T_keyframe_map = self.map.keyframes[index].state.pose().inverse()
        self._tracked.append((stamp_ns, index, T_keyframe_map @ self.T_map_camera()))

    def T_map_camera(self) -> SE3:
        """The newest pose of the camera."""
        return self.state.pose() @ self.T_rig_camera

    def trajectory(self) -> Trajectory | None:
        """Every image noted, hung on its keyframe where that is now."""
        if not self._tracked:
            return None
        keyframes = [keyframe.state.pose() for keyframe in self.map.keyframes]
        poses = [keyframes[k] @ T for _, k, T in self._tracked]
        return Trajectory.from_poses([stamp for stamp, _, _ in self._tracked], poses)

    def adjust_all(self) -> None:
        """Adjust the whole map and go on from its newest keyframe."""
        newest = self.map.keyframes[-1]
        T_before_map = newest.state.pose().inverse()
        self.adjuster.adjust_all(self.inertial)
        self.state = replace(
            self.state.moved(newest.state.pose() @ T_before_map),
            gyro_bias=newest.state.gyro_bias,
            accelerometer_bias=newest.state.accelerometer_bias,
        )

    def make_upright(self, scale: float, R_new_map: NDArray[np.float64]) -> None:
        """Scale the map to metres and turn it so that z points up."""
        lever = self.T_rig_camera.translation
        self.map.move(scale, R_new_map, lever)
        self.state = self.state.scaled(scale, R_new_map, lever)
        self.metric = True

    def make_inertial(self, alignment: InertialAlignment) -> None:
        """Make the map metric and upright; from now on the accelerometer counts."""
        self.make_upright(alignment.scale, alignment.R_map_v)
        newest = self.map.keyframes[-len(alignment.velocities) :]
        for n, keyframe in enumerate(newest):
            keyframe.state = replace(
                keyframe.state,
                velocity=alignment.velocities[n],
                gyro_bias=alignment.gyro_biases[n],
                accelerometer_bias=alignment.accelerometer_biases[n],
            )
        self.state = self.map.keyframes[-1].state
        self.inertial = True
        self.adjust_all()

    def covariance(self, fit: PoseFit) -> NDArray[np.float64]:
        """(6, 6) of the newest pose: that of the image within the map, and of the map."""
        return fit.covariance + self._keyframe_covariance

    def unseen_s(self) -> float:
        """How long ago an image gave a pose [s]."""
        return 0.0 if self.stamp_ns is None else (self.stamp_ns - self._seen_ns) * 1e-9

    def depth_range(self) -> tuple[float, float] | None:
        """Nearest and farthest map point in the newest image [m]."""
        ids = self.tracker.ids[self.map.mapped(self.tracker.ids)]
        if len(ids) < self.parameters.min_points:
            return None
        z = (self.T_map_camera().inverse() @ self.map.positions[ids])[:, 2]
        low, high = np.percentile(z, [DEPTH_RANGE_PERCENT, 100 - DEPTH_RANGE_PERCENT])
        return (float(low), float(high)) if low > 0 else None

    def _guessed_turn(self, frame: Frame) -> NDArray[np.float64]:
        """(3, 3) turn of the rig to the next image, for want of a gyro."""
        slide = None if self._image_turn is None else self._image_turn.follow(frame.image)
        if slide is None:
            return self._turn
        R = self.T_rig_camera.rotation
        about = so3.log(R.T @ self._turn @ R)
        return R @ so3.exp(np.array([slide[0], slide[1], about[2]])) @ R.T

    def _fit(self, frame: Frame, prediction: Prediction) -> PoseFit | None:
        """The pose by the map points that were followed into this image."""
        rows = np.flatnonzero(self.map.mapped(self.tracker.ids))
        ids = self.tracker.ids[rows]
        pixels = self.tracker.pixels[rows].astype(np.float64)
        depths = None
        if frame.depth is not None:
            depths = inverse_depths_at(frame.depth, pixels, self._max_depth_m)
        fit = frame_pose(
            self.map.positions[ids],
            pixels,
            self.camera,
            prediction.state.pose() @ self.T_rig_camera,
            sigma_px=self.parameters.corner_sigma_px,
            rotation_sigma=prediction.rotation_sigma,
            inertial=prediction.inertial,
            min_points=self.parameters.min_points,
            rng=self._rng,
            inverse_depths=depths,
            inverse_depth_sigma=self._inverse_depth_sigma,
        )
        if fit is None or self._jumps(fit, prediction):
            return None
        self.tracker.judge(ids, fit.inliers, PATIENCE)
        return fit

    def _jumps(self, fit: PoseFit, prediction: Prediction) -> bool:
        """Whether a pose is too far from where inertia would have carried the robot."""
        if not self.metric:
            return False
        expected = prediction.state.pose() @ self.T_rig_camera
        off = fit.T_map_camera.translation - expected.translation
        return float(np.linalg.norm(off)) > MAX_JUMP_M

    def _recover(self, frame: Frame, prediction: Prediction) -> PoseFit | None:
        """Look for the map where it should be, then anywhere."""
        if not self._tracked:
            return None
        expected = prediction.state.pose() @ self.T_rig_camera
        found = self._recovery.near(frame.image, expected) or self._recovery.anywhere(frame.image)
        if found is None:
            return None
        self.tracker.clear()
        self.tracker.advance(frame.image, self.tracker.pixels)
        self.tracker.add(found.ids, found.pixels)
        return found.fit

    def _move_on(self, frame: Frame, prediction: Prediction, fit: PoseFit | None) -> None:
        """The state at this image: as measured, or else as predicted."""
        assert self.stamp_ns is not None
        before, seconds = self.state, (frame.stamp_ns - self.stamp_ns) * 1e-9
        state = prediction.state
        coasted_s = (frame.stamp_ns - self._seen_ns) * 1e-9
        if fit is not None:
            state = state.posed(fit.T_map_camera @ self.T_rig_camera.inverse())
            if not prediction.inertial:
                step = state.position - before.position
                followed = self._seen_ns == self.stamp_ns
                state = replace(state, velocity=step / seconds if followed else np.zeros(3))
            self._seen_ns = frame.stamp_ns
        elif not prediction.inertial or coasted_s > MAX_COAST_S:
            state = replace(before, velocity=np.zeros(3))
        self._turn = before.rotation.T @ state.rotation
        self.state, self.stamp_ns = state, frame.stamp_ns

    def _wants_keyframe(self) -> bool:
        """Whether the newest image shows enough that the last keyframe did not."""
        assert self.stamp_ns is not None
        last, parameters = self.map.keyframes[-1], self.parameters
        timed = self.metric and self.calibration.imu is not None
        if timed and (self.stamp_ns - last.stamp_ns) * 1e-9 >= parameters.keyframe_interval_s:
            return True
        view = self.state.rotation @ self.T_rig_camera.rotation
        last_view = last.state.rotation @ self.T_rig_camera.rotation
        news = what_is_new(self.map, last, self.tracker, last_view.T @ view, self.camera)
        return (
            news.share_left < parameters.keyframe_share
            or news.mapped_left < parameters.keyframe_share
            or news.parallax_px > parameters.keyframe_parallax_px
        )

    def _insert(self, frame: Frame, still: bool = False) -> bool:
        """Make the newest image a keyframe; returns whether the whole map was adjusted."""
        motion = None
        if self.map.keyframes:
            motion = self.motion.preintegrate(
                self.map.keyframes[-1].stamp_ns, frame.stamp_ns, self.state
            )
        new = NewKeyframe(frame.stamp_ns, frame.image, frame.depth, self.state, motion, still)
        covariance = self._mapper.insert(new, self.inertial)
        if covariance is not None:
            self._keyframe_covariance = covariance
        adjusted = self.map.keyframes[-1].state
        if not self.inertial:
            adjusted = replace(adjusted, velocity=self.state.velocity)
        self.state = adjusted
        self._recovery.add_keyframe()
        if len(self.map.keyframes) < self._next_global:
            return False
        self._next_global = int(GLOBAL_ADJUSTMENT_GROWTH * self._next_global)
        self.adjust_all()
        return True

"""Keyframe-based SLAM of one camera, with depth, an IMU, both or neither (Sec. IV).

Corners are followed from image to image; those that are in the map give the pose; now and
then an image becomes a keyframe and extends the map. How a map begins is in `starts.py`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from airground.config import KeyframeSlam as Parameters
from airground.core.arrays import F64
from airground.core.messages import RobotCalibration
from airground.core.se3 import SE3
from airground.core.trajectory import Trajectory
from airground.slam.culling import KeyframeCuller
from airground.slam.doubt import Doubt, jumps, surprising
from airground.slam.feature_tracker import FeatureTracker, expected_pixels
from airground.slam.frame import Frame
from airground.slam.frame_pose import frame_pose
from airground.slam.front_end import TrackedCorners
from airground.slam.geometry.pose_estimation import PoseFit
from airground.slam.image_turn import ImageTurn
from airground.slam.inertial.stationarity import Rest
from airground.slam.inertial_bridge import InertialBridge
from airground.slam.keyframe_choice import KeyframeChoice
from airground.slam.local_mapping import LocalMapper
from airground.slam.loop_closure import LoopCloser
from airground.slam.map_adjustment import MapAdjuster
from airground.slam.motion_model import MotionModel, Prediction
from airground.slam.recovery import Recovery
from airground.slam.rig_state import RigState
from airground.slam.shared_errors import SharedErrors
from airground.slam.sparse_map import SparseMap
from airground.slam.spread_adjustment import WholeMap
from airground.slam.starts import REST_WINDOW_NS, MovingStart
from airground.slam.tracked_path import TrackedPath


class KeyframeSlam:
    """The machinery that both robots share.

    Args:
        parameters: The robot's section of the configuration.
        inverse_depth_sigma: Standard deviation of measured inverse depth [1/m].
        max_depth_m: Largest depth that starts a point [m].

    Attributes:
        tracker: The corners that are followed.
        stamp_ns: Stamp of the newest state [ns]; None before the map began.
        inertial: Whether the accelerometer counts: the map is metric and upright.
        metric: Whether the map's unit is the metre.
        published: Whether poses of this map were given out; it is then searched for when lost.
        settled: Whether scale and vertical are known, so that keyframes may be culled.
        moved_from: Pose of the newest image before the whole map was adjusted, else None.
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
        self.tracker = FeatureTracker.guided(parameters.patch_px, calibration.imu is not None)
        self._image_turn = ImageTurn(self.camera) if calibration.imu is None else None
        self.metric = self.inertial = False
        self._sigmas = inverse_depth_sigma, calibration.accelerometer_bias_sigma
        self._max_depth_m, self._rng, self.path = max_depth_m, rng, TrackedPath()
        self.reset()

    def reset(self) -> None:
        """Forget the map; images that were tracked in it are given up."""
        self.map = SparseMap()
        self.tracker.clear()
        self.state = RigState.at_origin()
        self.stamp_ns: int | None = None
        self._turn, self._seen_ns = np.eye(3), 0
        self._keyframe_covariance = np.zeros((6, 6))
        self._shared_errors = SharedErrors(self.calibration.sigmas)
        self._doubt: Doubt | None = None
        self._torn = self._adrift = self.published = self.settled = False
        self.moved_from: SE3 | None = None
        self.path.clear()
        own = self.camera, self.T_rig_camera, self.parameters
        self.adjuster = MapAdjuster(self.map, *own, *self._sigmas)
        self._mapper = LocalMapper(self.map, self.tracker, self.adjuster, *own, self._max_depth_m)
        self._recovery = Recovery(self.map, *own)
        self._loops = LoopCloser(
            self.map, self.tracker, self.adjuster, self._recovery, *own, self._max_depth_m
        )
        self._whole = WholeMap(self.map, self.adjuster, self._loops)
        self._choice = KeyframeChoice(self.map, *own)
        self._bridge = InertialBridge(self.map, self.motion, self.parameters, self._max_depth_m)
        self._culler = KeyframeCuller(self.map, self.adjuster, self._recovery, self.path, *own)

    @property
    def begun(self) -> bool:
        """Whether there is a map to track in."""
        return self.stamp_ns is not None

    def begin(self, frame: Frame, state: RigState) -> None:
        """Start the map with this image as its first keyframe."""
        self.tracker.restart(frame.image)
        self.state, self.stamp_ns, self._seen_ns = state, frame.stamp_ns, frame.stamp_ns
        self._insert(frame)

    def begin_moving(self, start: MovingStart) -> None:
        """Start the map with two views; its unit is the first one's median depth."""
        ids = self.map.new_points(start.pixels_first, 0)
        self.map.place(ids, start.points_map)
        for frame, state, pixels in start.views():
            self.tracker.restart(frame.image)
            self.tracker.add(ids, pixels)
            self.state, self.stamp_ns, self._seen_ns = state, frame.stamp_ns, frame.stamp_ns
            self._insert(frame)
        for stamp_ns, T_map_camera in start.views_before:
            self.path.note(stamp_ns, T_map_camera, self.map.keyframes[:1])
        self.note(start.second.stamp_ns)

    def track(self, frame: Frame) -> tuple[PoseFit | None, bool]:
        """Follow the map into the next image.
        Returns the fit, None where the image gave none, and whether the whole map was adjusted."""
        assert self.stamp_ns is not None
        turn, self.moved_from = self._turn, None
        if self._image_turn is not None:
            turn = self._image_turn.rig_turn(frame.image, turn, self.T_rig_camera.rotation)
        prediction = self._predict(frame, turn)
        lost = self._seen_ns != self.stamp_ns
        there = prediction.state.pose() @ self.T_rig_camera
        expected = expected_pixels(self.map, self.tracker, self.camera, self.T_map_camera(), there)
        followed = len(self.tracker.ids)
        seen_px = self.tracker.advance(frame.image, expected, 2 if lost else 0)
        frame = frame.followed(self.calibration, seen_px, self.tracker.pixels, self.stamp_ns)
        self._mapper.straighten_first(frame.shutter)
        cut = len(self.tracker.ids) < self.parameters.min_points <= followed
        fit = self._fit(frame, prediction)
        if fit is None and self._doubt is not None:
            self._go_back(self._doubt, frame)
            prediction = self._predict(frame, turn)
        elif self._doubt is not None:
            self._doubt.confirmations += 1
        if fit is None:
            fit = self._recover(frame, prediction)
        self._move_on(frame, prediction, fit)
        self._adrift = fit is None and (self._adrift or cut or not prediction.inertial)
        if self._in_doubt():
            return None, False
        if fit is None and (self._adrift or self.published):
            return None, self._bridge_over(frame)
        timed = self.metric and self.calibration.imu is not None
        if self._choice.wanted(self.tracker, self.state, frame.stamp_ns, timed):
            before = self.T_map_camera()
            if self.calibration.imu is None:
                self.path.lead(frame.stamp_ns, self.state.pose(), self.map.keyframes)
            adjusted = self._insert(frame)
            self.moved_from = before if adjusted else None
            return fit, adjusted
        return fit, self._follow(self._whole.go_on)

    def note(self, stamp_ns: int) -> None:
        """Remember the newest pose as one of the trajectory."""
        self.path.note(stamp_ns, self.T_map_camera(), self.map.keyframes)

    def T_map_camera(self) -> SE3:
        """The newest pose of the camera."""
        return self.state.pose() @ self.T_rig_camera

    def trajectory(self) -> Trajectory | None:
        """Every image noted, hung on its keyframe where that is now."""
        return self.path.trajectory(self.map.keyframes)

    def adjust_all(self, at_once: bool = True) -> bool:
        """Adjust the whole map, `at_once` or as `WholeMap.begin`; returns whether it was."""
        spread = self.settled and not at_once
        return self._follow(self._whole.begin if spread else self._whole.at_once)

    def make_upright(self, scale: float, R_new_map: F64) -> None:
        """Scale the map to metres and turn it so that z points up."""
        self.move(scale, R_new_map)
        self.metric = True

    def move(self, scale: float, R_new_map: F64, place: F64 | None = None) -> None:
        """Scale and turn the map about its origin, or so that its newest camera ends in a place."""
        lever = self.T_rig_camera.translation
        self.path.scale(scale, lever)
        self._whole.begin_anew()
        self.map.move(scale, R_new_map, lever)
        self.state = self.state.scaled(scale, R_new_map, lever)
        if place is not None:
            by = place - self.T_map_camera().translation
            self.map.shift(by)
            self.state = self.state.shifted(by)

    def stand_still(self, frame: Frame, rest: Rest) -> None:
        """The robot stood still up to the newest image: from now on the accelerometer counts."""
        self.state = self.state.standing(rest)
        self.map.stand_still(frame.stamp_ns - REST_WINDOW_NS, rest)
        self.inertial = True
        if self.map.keyframes[-1].stamp_ns != frame.stamp_ns:
            self._insert(frame, still=True)
        self.adjust_all()

    def covariance(self, fit: PoseFit, scale_sigma: float, tilt_sigma: float) -> F64:
        """(6, 6) of the newest pose, within the map and of the map; to be asked once an image."""
        motion = fit.T_map_camera, self.state.velocity
        shared = self._shared_errors.at(*motion, scale_sigma, tilt_sigma)
        shared += self._bridge.covariance(self.tracker.ids, tilt_sigma)
        return fit.covariance + self._keyframe_covariance + shared

    def unseen_s(self) -> float:
        """How long ago an image gave a pose [s]."""
        return 0.0 if self.stamp_ns is None else (self.stamp_ns - self._seen_ns) * 1e-9

    def stranded(self) -> bool:
        """Whether neither images nor, from an image that was tied to the map, inertia lead here."""
        followed = int(self.map.mapped(self.tracker.ids).sum())
        return self._adrift and followed < self.parameters.min_points

    def corners(self) -> TrackedCorners:
        """What is followed in the newest image."""
        return TrackedCorners(self.tracker.pixels, self.map.mapped(self.tracker.ids))

    def depth_range(self) -> tuple[float, float] | None:
        """Nearest and farthest map point in the newest image [m]."""
        seen = self.tracker.ids, self.T_map_camera()
        return self.map.depth_range(*seen, self.parameters.min_points)

    def _predict(self, frame: Frame, turn: F64) -> Prediction:
        assert self.stamp_ns is not None
        known = self.inertial, self.metric and self._seen_ns == self.stamp_ns
        return self.motion.predict(self.state, turn, self.stamp_ns, frame.stamp_ns, *known)

    def _fit(self, frame: Frame, prediction: Prediction) -> PoseFit | None:
        """The pose by the map points that were followed into this image."""
        rows = np.flatnonzero(self.map.mapped(self.tracker.ids))
        ids = self.tracker.ids[rows]
        pixels = self.tracker.pixels[rows].astype(np.float64)
        expected = prediction.state.pose() @ self.T_rig_camera
        fit = frame_pose(
            self.map.positions[ids],
            frame.shutter.straight(pixels),
            self.camera,
            expected,
            sigma_px=self.parameters.corner_sigma_px,
            rotation_sigma=prediction.rotation_sigma,
            position_sigma=prediction.position_sigma,
            min_points=self.parameters.min_points,
            rng=self._rng,
            inverse_depths=frame.shutter.inverse_depths_at(frame.depth, pixels, self._max_depth_m),
            inverse_depth_sigma=self.adjuster.inverse_depth_sigma,
        )
        if fit is None or (self.metric and jumps(fit.T_map_camera, expected)):
            return None
        self.tracker.judge(ids, fit.inliers)
        return fit

    def _recover(self, frame: Frame, prediction: Prediction) -> PoseFit | None:
        """Look for the map where it should be, then anywhere."""
        if not self.published or self.stamp_ns is None:
            return None
        expected = prediction.state.pose() @ self.T_rig_camera
        found = self._recovery.find(frame, expected, prediction.rotation_sigma is not None)
        if found is None:
            return None
        if surprising(found.fit.T_map_camera, expected, (frame.stamp_ns - self._seen_ns) * 1e-9):
            there = self.state.posed(found.fit.T_map_camera @ self.T_rig_camera.inverse())
            self._doubt = Doubt(self.state, self.stamp_ns, self._seen_ns, there, frame.stamp_ns)
        self.tracker.restart(frame.image)
        self.tracker.add(found.ids, found.pixels)
        return found.fit

    def _go_back(self, doubt: Doubt, frame: Frame) -> None:
        """Forget a place that images do not confirm."""
        self.state, self.stamp_ns, self._seen_ns = doubt.state, doubt.stamp_ns, doubt.seen_ns
        self._doubt = None
        self.tracker.restart(frame.image)

    def _bridge_over(self, frame: Frame) -> bool:
        """Map on from where inertia has led, if that is due; returns whether all was adjusted."""
        known = self.published and self.inertial
        if not (known and self._bridge.due(frame, self.state, self._seen_ns)):
            return False
        self.tracker.restart(frame.image)
        return self._insert(frame)

    def _in_doubt(self) -> bool:
        """Whether the newest pose still waits to be confirmed."""
        if self._doubt is None or not self._doubt.settled:
            return self._doubt is not None
        assert self.stamp_ns is not None
        # Inertia did not bring the robot here, and must not draw it back.
        self.state = self._doubt.with_velocity(self.state, self.stamp_ns)
        self._doubt, self._torn = None, True
        return False

    def _move_on(self, frame: Frame, prediction: Prediction, fit: PoseFit | None) -> None:
        """The state at this image: as measured, or else as predicted."""
        assert self.stamp_ns is not None
        before, followed = self.state, self._seen_ns == self.stamp_ns
        if fit is not None:
            T_map_rig = fit.T_map_camera @ self.T_rig_camera.inverse()
            seconds = (frame.stamp_ns - self.stamp_ns) * 1e-9 if followed else None
            state = self.motion.measured(before, prediction, T_map_rig, seconds)
            self._seen_ns = frame.stamp_ns
        else:
            unseen_s = (frame.stamp_ns - self._seen_ns) * 1e-9
            state = self.motion.coasted(before, prediction, unseen_s)
        self._turn = before.rotation.T @ state.rotation
        self.state, self.stamp_ns = state, frame.stamp_ns

    def _insert(self, frame: Frame, still: bool = False) -> bool:
        """Make the newest image a keyframe; returns whether the whole map was adjusted."""
        motion = None
        if self.map.keyframes and not self._torn:
            motion = self.motion.preintegrate(
                self.map.keyframes[-1].stamp_ns, frame.stamp_ns, self.state
            )
        self._torn = False
        covariance = self._mapper.insert(frame, self.state, motion, self.inertial, still)
        if covariance is not None:
            self._keyframe_covariance = covariance
        adjusted = self.map.keyframes[-1].state
        if not self.inertial:
            adjusted = replace(adjusted, velocity=self.state.velocity)
        self.state = adjusted
        self._recovery.add_keyframe()
        if not self._mapper.found_old:
            self._loops.consider(frame.depth, self.inertial)
        # Until scale and vertical are known, they are sought by all keyframes.
        if self.settled:
            self._culler.cull(self.inertial)
        self.motion.forget_before(self.map.keyframes[-1].stamp_ns)
        return self.adjuster.all_due() and self.adjust_all(at_once=False)

    def _follow(self, adjust: Callable[[bool], bool]) -> bool:
        """Go on from the newest keyframe if the whole map is adjusted; returns whether it was."""
        before, here = self.map.keyframes[-1].state.pose(), self.T_map_camera()
        adjusted = adjust(self.inertial)
        if adjusted:
            self.moved_from = here
            self.state = self.state.following(before, self.map.keyframes[-1].state)
        return adjusted

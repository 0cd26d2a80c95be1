"""Monocular visual-inertial SLAM of the MAV (Sec. IV)."""

from __future__ import annotations

import numpy as np

from airground.config import Config
from airground.core.arrays import F64
from airground.core.blas_threads import one_blas_thread
from airground.core.messages import ImuSamples, MavImage, RobotCalibration
from airground.core.trajectory import Trajectory
from airground.slam.filtered_scale import FilteredScale
from airground.slam.frame import Frame, require_order
from airground.slam.front_end import ScaleEstimate, TrackedPose, Tracking
from airground.slam.geometry.pose_estimation import PoseFit
from airground.slam.keyframe_slam import KeyframeSlam
from airground.slam.stale_images import StaleImages
from airground.slam.starts import RestStart, TwoViewWait
from airground.slam.tight_scale import TightScale

MIN_TRACKED = 30
"""Least number of map points in the image of the first published pose."""
UNKNOWN_SCALE = ScaleEstimate(np.inf, observable=False)
"""The estimate before any motion."""
MAX_UNSEEN_S = 3.5
"""Time without a pose after which a new map is started again [s]."""


class MonocularSlam:
    """A front end of the MAV, with the section `monocular_slam` of the configuration.

    A map begins with two views and an unknown scale, at rest or in flight. Poses are given out
    when the scale is known; `trajectory` also has those of the images before, back to the first
    view. Where the motion never shows the scale, it has poses up to scale after `finish`.
    """

    def __init__(
        self, calibration: RobotCalibration, config: Config, rng: np.random.Generator
    ) -> None:
        slam_rng, start_rng = rng.spawn(2)
        self._slam = KeyframeSlam(calibration, config.monocular_slam, slam_rng)
        self._tight = config.monocular_slam.scale == "tight"
        self._scale = self._unknown_scale()
        self._rest = RestStart(calibration)
        self._two_views = TwoViewWait(calibration, config.monocular_slam, start_rng)
        self._left = self._finished = False
        self._images = StaleImages(self._slam)
        self._last_ns: int | None = None

    def add_imu(self, samples: ImuSamples) -> None:
        """Take the inertial measurements up to the next image."""
        self._slam.motion.add(samples)

    @one_blas_thread()
    def track(self, image: MavImage) -> TrackedPose:
        """The pose of the camera at `image`."""
        require_order(image.stamp_ns, self._last_ns)
        self._last_ns = image.stamp_ns
        frame = Frame(image.stamp_ns, image.image)
        slam = self._slam
        if not slam.begun:
            self._begin(frame)
            return self._initializing(frame)
        fit, corrected = self._images.track(frame)
        corrected |= self._scale.update(fit is not None)
        if fit is not None:
            slam.note(image.stamp_ns)
        if self._hopeless():
            self._give_up()
        if not slam.published:
            if fit is None or fit.inliers.sum() < MIN_TRACKED or not self._scale.known:
                return self._initializing(frame)
            slam.published = True
        slam.settled = self._scale.settled
        if fit is None:
            return TrackedPose(image.stamp_ns, Tracking.LOST, None, scale=self._scale.estimate)
        return TrackedPose(
            image.stamp_ns,
            Tracking.TRACKED,
            slam.T_map_camera(),
            self._covariance(fit),
            self._scale.estimate,
            slam.depth_range(),
            corrected,
            slam.corners(),
        )

    @one_blas_thread()
    def finish(self) -> None:
        """Adjust the whole map."""
        self._finished = True
        if self._slam.begun:
            self._slam.adjust_all()
            self._scale.finish()

    def trajectory(self) -> Trajectory | None:
        """The newest poses of all images tracked so far, and of those before, back to the first
        view of the map; None before the first pose, or before `finish` where the scale stayed
        unknown."""
        return self._slam.trajectory() if self._slam.published or self._finished else None

    def _begin(self, frame: Frame) -> None:
        """Begin the map if two views allow it; a robot that rested knows its gyro's bias."""
        motion = self._slam.motion
        # Even flight reads as rest: after the first map the robot may be in the air.
        if not self._left:
            self._rest.observe(frame, motion)
        resting = self._rest.resting and not self._left
        start = self._two_views.observe(frame, motion, resting)
        if start is None:
            return
        rest = self._rest.rest
        self._slam.adjuster.turns = rest is not None
        self._slam.begin_moving(start if rest is None else start.biased(rest))

    def _hopeless(self) -> bool:
        """Whether a map with an unknown scale is lost for good. One without a published pose is
        not searched for: nothing leads back to it."""
        slam = self._slam
        if not slam.published:
            return slam.stranded() or slam.unseen_s() > MAX_UNSEEN_S
        return not self._scale.settled and slam.unseen_s() > MAX_UNSEEN_S

    def _give_up(self) -> None:
        """Forget the map, and all that was known of its unit."""
        self._left = True
        self._slam.reset()
        self._slam.metric = self._slam.inertial = False
        self._scale = self._unknown_scale()

    def _unknown_scale(self) -> TightScale | FilteredScale:
        return TightScale(self._slam) if self._tight else FilteredScale(self._slam)

    def _covariance(self, fit: PoseFit) -> F64:
        scale = self._scale.estimate
        scale_sigma = min(scale.sigma, 1.0) if scale is not None else 1.0
        return self._slam.covariance(fit, scale_sigma, self._scale.tilt_sigma)

    def _initializing(self, frame: Frame) -> TrackedPose:
        scale = self._scale.estimate or UNKNOWN_SCALE
        return TrackedPose(
            frame.stamp_ns, Tracking.INITIALIZING, None, scale=scale, waiting=self._waiting()
        )

    def _waiting(self) -> str:
        """What is waited for and how far it got, in words."""
        slam = self._slam
        if not slam.begun:
            resting = self._rest.resting and not self._left
            waiting = "motion: the IMU reads rest" if resting else self._two_views.waiting()
        elif self._scale.known:
            seen = int(slam.map.mapped(slam.tracker.ids).sum())
            waiting = f"{MIN_TRACKED} map points in the image: {seen} in the newest"
        else:
            stamps_ns = [keyframe.stamp_ns for keyframe in slam.map.keyframes]
            seconds = (stamps_ns[-1] - stamps_ns[0]) * 1e-9
            keyframes = f"{len(stamps_ns)} keyframes in {seconds:.1f} s"
            waiting = f"the scale: {keyframes} do not show it yet"
            estimate = self._scale.estimate
            if estimate is not None and np.isfinite(estimate.sigma):
                tilt_deg = np.rad2deg(self._scale.tilt_sigma)
                waiting = (
                    f"the scale: after {keyframes} it is known to {estimate.sigma:.0%} and the "
                    f"vertical to {tilt_deg:.1f} deg"
                )
        return f"{waiting} (a map was given up before)" if self._left else waiting

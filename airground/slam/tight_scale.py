"""Metric scale and the vertical of a monocular map, tightly coupled with its IMU (Sec. IV)."""

from __future__ import annotations

import numpy as np

from airground.slam.front_end import ScaleEstimate
from airground.slam.inertial.alignment import (
    HOPELESS_SIGMA,
    OBSERVABLE_SIGMA,
    InertialAlignment,
    VisualNoise,
    align,
    refine_scale,
)
from airground.slam.inertial.preintegration import GRAVITY, Preintegration
from airground.slam.keyframe_slam import KeyframeSlam

MIN_KEYFRAMES = 6
MIN_SECONDS = 0.6
"""Least duration of a motion that shows the scale [s]: a take-off does so in this time."""
MAX_KEYFRAMES = 60
"""Number of newest keyframes that a scale is searched over."""
METRIC_SIGMA = 0.06
"""A map becomes metric when its scale is known this well [share]. From then on inertial factors
improve it."""
GIVE_OUT_SIGMA = 0.03
"""Poses of a metric map are given out when its scale is known this well [share] ..."""
GIVE_OUT_S = 1.5
"""... or after this duration of the map [s]. A take-off shows the scale sooner, and meanwhile
doubles the robot's height every half second, so that a pose would be off by centimetres."""
SETTLED_SIGMA = 0.02
"""The scale counts as known from this standard deviation on [share] ..."""
SETTLED_TILT = np.deg2rad(0.5)
"""... and the vertical from this one on [rad] ..."""
TILT_PATIENCE_S, PATIENT_TILT = 6.0, 1.2
"""... or, after so long [s], this well, as a multiple of the tilt that the accelerometer's bias
seems to be: in flight without turning the two cannot be separated."""
UNKNOWN_TILT = np.deg2rad(5.0)
"""Standard deviation of the vertical by one reading of the accelerometer [rad]."""
POSE_SIGMA_PX = 0.3
"""Noise of a keyframe's place, as its points would see it [px]."""


class TightScale:
    """Inertial factors in bundle adjustment hold the scale.

    A map begins with an unknown scale. It is scaled and turned upright once the motion shows the
    scale to `METRIC_SIGMA`; from then on inertial factors improve both.

    Attributes:
        estimate: How well the scale is known; None before the first alignment.
        known: Whether poses may be given out: the map is metric and its scale known.
        settled: Whether scale and vertical are known well.
        tilt_sigma: How well the vertical is known, per axis [rad].
    """

    def __init__(self, slam: KeyframeSlam) -> None:
        self.estimate: ScaleEstimate | None = None
        # Without an IMU the scale stays unknown: the unit is the scene's median depth.
        self.known = self.settled = slam.calibration.imu is None
        self.tilt_sigma = UNKNOWN_TILT
        self._bias_sigma = slam.calibration.accelerometer_bias_sigma
        self._slam = slam
        self._judged = 0

    def update(self, tracked: bool) -> bool:
        """Look at new keyframes, `tracked` or not; returns whether the map was moved."""
        slam = self._slam
        if slam.motion.buffer is None:
            self.estimate = ScaleEstimate(np.inf, observable=False)
            return False
        moved = self._judge()
        if slam.metric and self.estimate is not None:
            self.known |= self.estimate.sigma < GIVE_OUT_SIGMA or self._seconds() >= GIVE_OUT_S
        return moved

    def finish(self) -> None:
        """After the last image: give a map that is not metric yet the likeliest unit, if any."""
        if self._slam.metric or len(self._slam.map.keyframes) < MIN_KEYFRAMES:
            return
        alignment = self._alignment()
        if alignment is not None and alignment.scale_sigma < HOPELESS_SIGMA:
            self._learn(alignment)
            self._slam.make_upright(alignment.scale, alignment.R_map_v)

    def _judge(self) -> bool:
        """Look at new keyframes; returns whether the map was moved."""
        slam, count = self._slam, self._slam.map.made
        fresh = count > self._judged and (not self.settled or count >= 1.5 * self._judged)
        if not fresh or count < MIN_KEYFRAMES or self._seconds() < MIN_SECONDS:
            return False
        self._judged = count
        alignment = self._alignment()
        if alignment is None:
            return False
        self._learn(alignment)
        if slam.inertial:
            return self._correct(alignment)
        if not alignment.scale_sigma < METRIC_SIGMA:
            return False
        self._make_inertial(alignment)
        return True

    def _make_inertial(self, alignment: InertialAlignment) -> None:
        """Make the map metric and upright; from now on the accelerometer counts."""
        slam = self._slam
        slam.make_upright(alignment.scale, alignment.R_map_v)
        slam.map.set_motion(alignment)
        slam.state = slam.map.keyframes[-1].state
        slam.inertial = True
        slam.adjust_all()

    def _correct(self, alignment: InertialAlignment) -> bool:
        """Adjust the whole map where its scale is off by more than chance: the window that follows
        the robot keeps the scale of the keyframes that hold it. Returns whether it was."""
        if not abs(np.log(alignment.scale)) > alignment.scale_sigma:
            return False
        return self._slam.adjust_all(at_once=False)

    def _learn(self, alignment: InertialAlignment) -> None:
        """Take over how well scale and vertical are known."""
        sigma = alignment.scale_sigma
        if self._slam.metric and self.estimate is not None:
            # A metric map keeps its unit, whether newer motion shows it or not.
            sigma = min(sigma, self.estimate.sigma)
        self.estimate = ScaleEstimate(sigma, sigma < OBSERVABLE_SIGMA)
        self.tilt_sigma = min(alignment.tilt_sigma, UNKNOWN_TILT)
        patient = self._seconds() > TILT_PATIENCE_S
        seeming = PATIENT_TILT * self._bias_sigma / GRAVITY if patient else 0.0
        self.settled |= sigma < SETTLED_SIGMA and self.tilt_sigma < max(SETTLED_TILT, seeming)

    def _seconds(self) -> float:
        """Duration of the map [s]."""
        keyframes = self._slam.map.keyframes
        return (keyframes[-1].stamp_ns - keyframes[0].stamp_ns) * 1e-9

    def _alignment(self) -> InertialAlignment | None:
        """Scale and vertical by the newest keyframes with nothing missing between them."""
        slam = self._slam
        count = len(slam.map.keyframes)
        chosen = range(max(0, count - MAX_KEYFRAMES), count)
        motions: list[Preintegration | None] = [slam.adjuster.motions.get(k) for k in chosen[1:]]
        states = [slam.map.keyframes[k].state for k in chosen]
        rotations = np.array([state.rotation for state in states])
        centres = np.array(
            [state.position + state.rotation @ slam.T_rig_camera.translation for state in states]
        )
        camera, noise = slam.T_rig_camera, VisualNoise(pose_sigma(slam))
        if slam.inertial:
            return refine_scale(rotations, centres, camera, motions, noise, self._bias_sigma)
        known: list[Preintegration] = [motion for motion in motions if motion is not None]
        if len(known) < len(motions):
            return None
        return align(rotations, centres, camera, known, noise, self._bias_sigma)


def pose_sigma(slam: KeyframeSlam) -> float:
    """Noise of a camera's place, in the map's unit."""
    depths = slam.depth_range()
    return POSE_SIGMA_PX / slam.camera.fx * (depths[1] if depths else 1.0)

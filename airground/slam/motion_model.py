"""How a robot goes on until its next image."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from airground.core.arrays import F64
from airground.core.messages import ImuNoise, ImuSamples
from airground.core.se3 import SE3, nearest_rotation
from airground.slam.inertial.failed_samples import FailedSamples
from airground.slam.inertial.preintegration import ImuBuffer, Preintegration
from airground.slam.rig_state import RigState

MAX_GAP_S = 0.04
"""Inertial samples farther apart than this have a hole between them: a robot shakes faster."""
KEPT_NS = 1_000_000_000
"""Samples from before the last keyframe that are kept: the vertical is looked for in them when a
map begins anew [ns]."""
MAX_COAST_S = 3.0
"""For this long a robot is believed to go on without a look at the scene: it may then have stopped
or turned off."""
MAX_INERTIAL_COAST_S = 6.0
"""The same by inertia, which drifts by 0.1 m in 5 s."""
POSITION_SIGMA_M = 0.02
"""Standard deviation of an inertially predicted position, from one image to the next [m]."""
HAND_ACCELERATION = 3.0
"""Standard deviation of the acceleration of a hand-held camera per axis [m/s^2]."""
HAND_VELOCITY_SIGMA = 0.06
"""Standard deviation of its velocity by the last images per axis [m/s]. Both together are 5 mm from
one image to the next at 30 Hz; twice as much leaves steps of 3 cm in a real, turning recording."""
VELOCITY_GAIN = 0.5
"""Share of the newest step in the velocity of a camera without an accelerometer."""
ROTATION_SIGMA = 2e-3
"""Standard deviation of the gyro's turn between images, by clock, mounting and bias [rad]."""


@dataclass(frozen=True, eq=False)
class Prediction:
    """The state at the next image before looking at it.

    Attributes:
        state: Predicted state.
        rotation_sigma: How well the rotation is known [rad]; None without a gyro.
        position_sigma: How well the position is known per axis [m]; None where it is not.
        inertial: Whether position and velocity follow the accelerometer, too.
    """

    state: RigState
    rotation_sigma: float | None
    position_sigma: float | None
    inertial: bool


class MotionModel:
    """Predicts by the IMU where there is one, else by constant velocity.

    Args:
        imu: Noise of the robot's IMU; None without an IMU.
        time_offset_ns: Offset from the camera's clock to the IMU's [ns].
    """

    def __init__(self, imu: ImuNoise | None, time_offset_ns: int) -> None:
        self.buffer = ImuBuffer(imu) if imu is not None else None
        self._offset_ns = time_offset_ns
        self._failed = FailedSamples()

    def add(self, samples: ImuSamples) -> None:
        """Take samples; those that measure nothing count as missing."""
        if self.buffer is not None:
            self.buffer.add(self._failed.left_out(samples))

    def forget_before(self, stamp_ns: int) -> None:
        """Drop inertial samples from long before an image."""
        if self.buffer is not None:
            self.buffer.forget_before(self.imu_time(stamp_ns) - KEPT_NS)

    def imu_time(self, stamp_ns: int) -> int:
        """A stamp of the camera on the IMU's clock [ns]."""
        return stamp_ns + self._offset_ns

    def preintegrate(self, start_ns: int, end_ns: int, state: RigState) -> Preintegration | None:
        """Inertial motion between two images; None where samples are missing."""
        if self.buffer is None:
            return None
        start, end = self.imu_time(start_ns), self.imu_time(end_ns)
        if not self.buffer.covers(start, end):
            return None
        motion = self.buffer.preintegrate(start, end, state.gyro_bias, state.accelerometer_bias)
        return motion if motion.longest_gap_s <= MAX_GAP_S else None

    def predict(
        self,
        state: RigState,
        turn: F64,
        start_ns: int,
        end_ns: int,
        inertial: bool,
        followed: bool = False,
    ) -> Prediction:
        """The state at `end_ns`.

        Args:
            state: State at `start_ns`.
            turn: (3, 3) rotation to the previous image, used without a gyro.
            start_ns, end_ns: Stamps of two images [ns].
            inertial: Whether the accelerometer counts.
            followed: Whether the image at `start_ns` gave a pose, in metres.
        """
        seconds = (end_ns - start_ns) * 1e-9
        motion = self.preintegrate(start_ns, end_ns, state)
        coasted = replace(state, position=state.position + seconds * state.velocity)
        if motion is None:
            turned = replace(coasted, rotation=state.rotation @ turn)
            hand_m = HAND_ACCELERATION * seconds**2 + HAND_VELOCITY_SIGMA * seconds
            hand_held = followed and self.buffer is None
            return Prediction(turned, None, hand_m if hand_held else None, False)
        if not inertial:
            rotation, _, _ = motion.corrected(state.gyro_bias, state.accelerometer_bias)
            rotation = state.rotation @ rotation
            return Prediction(replace(coasted, rotation=rotation), ROTATION_SIGMA, None, False)
        rotation, position, velocity = motion.predict(
            state.rotation,
            state.position,
            state.velocity,
            state.gyro_bias,
            state.accelerometer_bias,
        )
        predicted = replace(state, rotation=rotation, position=position, velocity=velocity)
        return Prediction(predicted, ROTATION_SIGMA, POSITION_SIGMA_M, True)

    def measured(
        self, before: RigState, prediction: Prediction, T_map_rig: SE3, seconds: float | None
    ) -> RigState:
        """The state at an image that gave a pose, `seconds` after the previous image [s].
        `seconds` is None if that one had no pose, so that the velocity is unknown."""
        state = prediction.state.posed(T_map_rig)
        if prediction.inertial:
            return state
        if seconds is None:
            return replace(state, velocity=np.zeros(3))
        step = (state.position - before.position) / seconds
        if prediction.position_sigma is None:
            return replace(state, velocity=step)
        return replace(state, velocity=state.velocity + VELOCITY_GAIN * (step - state.velocity))

    def coasted(self, before: RigState, prediction: Prediction, unseen_s: float) -> RigState:
        """The state at an image that shows nothing, `unseen_s` after the last one with a pose [s]:
        a robot goes on for a while."""
        state = prediction.state
        if prediction.inertial:
            # After missing images one prediction may reach over all of them.
            stopped = unseen_s > MAX_INERTIAL_COAST_S
            return replace(state, velocity=np.zeros(3)) if stopped else state
        if unseen_s > MAX_COAST_S:
            turned = before if prediction.rotation_sigma is None else state
            return replace(before, rotation=turned.rotation, velocity=np.zeros(3))
        # The last turn is repeated; without this its rounding error would double each time.
        rotation = nearest_rotation(state.rotation)
        # What drives along a curve turns its velocity with it.
        velocity = rotation @ before.rotation.T @ before.velocity
        return replace(state, rotation=rotation, velocity=velocity)

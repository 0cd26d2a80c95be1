"""Inertial samples between two images, summed up once and corrected for bias afterwards.

Forster, Carlone, Dellaert and Scaramuzza, "On-manifold preintegration for real-time
visual-inertial odometry", T-RO 2017.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from airground.core.arrays import F64
from airground.core.messages import ImuNoise, ImuSamples
from airground.errors import InputError
from airground.slam import so3
from airground.slam.inertial.preintegration_kernel import preintegrate

GRAVITY = 9.81
"""Norm of gravity [m/s^2]."""

GRAVITY_MAP = np.array([0.0, 0.0, -GRAVITY])
"""Gravity in a map whose z axis points up [m/s^2]."""
GRAVITY_MAP.flags.writeable = False

MAX_HELD_S = 0.02
"""How far beyond the samples their nearest one is held: an image comes up to one sample and
the clocks' difference after the newest of them [s]."""

FIRST_CAPACITY = 4096
OPEN_VARIANCE = 1e4
"""Variance of a velocity [m^2/s^2] or position [m^2] that nothing is known of: a hundred times
what a robot here reaches in a second."""

Rotation = F64
Vector = F64


@dataclass(frozen=True, eq=False)
class Preintegration:
    """Motion between two times, free of where, how fast and how tilted it began.

    With the state (R, p, v) at the start: R' = R `rotation`, v' = v + g t + R `velocity`,
    p' = p + v t + g t^2 / 2 + R `position`. All arrays are read-only. Made by `ImuBuffer`.

    Attributes:
        duration_s: Time between start and end [s].
        rotation: (3, 3) rotation of the rig at the end in the rig at the start.
        velocity, position: (3,) change without gravity, in the rig at the start [m/s], [m].
        rotation_by_gyro_bias: (3, 3) derivative d theta / d bias, for rotation @ exp(theta).
        velocity_by_gyro_bias, velocity_by_accelerometer_bias: (3, 3) derivatives of the velocity.
        position_by_gyro_bias, position_by_accelerometer_bias: (3, 3) derivatives of the position.
        covariance: (9, 9) covariance by white noise, in the order rotation, velocity, position.
        gyro_bias, accelerometer_bias: (3,) biases that were subtracted [rad/s], [m/s^2].
        gyro_bias_sigma, accelerometer_bias_sigma: Standard deviation of the biases' random walk
            over the motion, per axis.
        longest_gap_s: Longest time between neighbouring samples, those just outside
            included, or without any at the ends [s].
    """

    duration_s: float
    rotation: F64
    velocity: F64
    position: F64
    rotation_by_gyro_bias: F64
    velocity_by_gyro_bias: F64
    velocity_by_accelerometer_bias: F64
    position_by_gyro_bias: F64
    position_by_accelerometer_bias: F64
    covariance: F64
    gyro_bias: F64
    accelerometer_bias: F64
    gyro_bias_sigma: float
    accelerometer_bias_sigma: float
    longest_gap_s: float

    def by_biases(self) -> F64:
        """(9, 6) derivative of rotation, velocity and position by the two biases."""
        jacobian = np.zeros((9, 6))
        jacobian[0:3, 0:3] = self.rotation_by_gyro_bias
        jacobian[3:6, 0:3] = self.velocity_by_gyro_bias
        jacobian[3:6, 3:6] = self.velocity_by_accelerometer_bias
        jacobian[6:9, 0:3] = self.position_by_gyro_bias
        jacobian[6:9, 3:6] = self.position_by_accelerometer_bias
        return jacobian

    def corrected(
        self, gyro_bias: Vector, accelerometer_bias: Vector
    ) -> tuple[Rotation, Vector, Vector]:
        """Rotation, velocity and position at other biases, to first order."""
        gyro = gyro_bias - self.gyro_bias
        force = accelerometer_bias - self.accelerometer_bias
        rotation = self.rotation @ so3.exp(self.rotation_by_gyro_bias @ gyro)
        velocity = (
            self.velocity
            + self.velocity_by_gyro_bias @ gyro
            + self.velocity_by_accelerometer_bias @ force
        )
        position = (
            self.position
            + self.position_by_gyro_bias @ gyro
            + self.position_by_accelerometer_bias @ force
        )
        return rotation, velocity, position

    def turn_only(self) -> Preintegration:
        """The motion as a gyro alone would know it: velocity and position are open."""
        covariance = np.diag([0.0] * 3 + [OPEN_VARIANCE] * 6)
        covariance[:3, :3] = self.covariance[:3, :3]
        return replace(self, covariance=covariance)

    def predict(
        self, R: Rotation, p: Vector, v: Vector, gyro_bias: Vector, accelerometer_bias: Vector
    ) -> tuple[Rotation, Vector, Vector]:
        """Rotation, position and velocity at the end, in a map whose z axis points up.

        Args:
            R, p, v: (3, 3), (3,), (3,) of the rig in the map at the start [m], [m/s].
            gyro_bias, accelerometer_bias: (3,) biases [rad/s], [m/s^2].
        """
        rotation, velocity, position = self.corrected(gyro_bias, accelerometer_bias)
        t = self.duration_s
        moved = p + t * v + 0.5 * t * t * GRAVITY_MAP + R @ position
        return R @ rotation, moved, v + t * GRAVITY_MAP + R @ velocity


class ImuBuffer:
    """Inertial samples as they come, and the motion between any two times among them."""

    def __init__(self, noise: ImuNoise) -> None:
        self._noise = noise
        self._stamps = np.empty(FIRST_CAPACITY, np.int64)
        self._readings = np.empty((FIRST_CAPACITY, 6))
        self._start = self._end = 0

    def __len__(self) -> int:
        """Samples at hand."""
        return self._end - self._start

    @property
    def newest_ns(self) -> int | None:
        """Stamp of the last sample; None while there is none."""
        return int(self._stamps[self._end - 1]) if len(self) else None

    def add(self, samples: ImuSamples) -> None:
        """Append samples; those that are not finite count as missing.

        Raises:
            InputError: They do not come after those already here.
        """
        finite = np.isfinite(samples.gyro).all(axis=1) & np.isfinite(samples.accelerometer).all(
            axis=1
        )
        stamps = samples.stamps_ns[finite]
        if len(stamps) == 0:
            return
        newest = self.newest_ns
        if newest is not None and stamps[0] <= newest:
            raise InputError(
                f"inertial sample at {stamps[0]} ns comes after one at {newest} ns: "
                "stamps must increase"
            )
        self._make_room(len(stamps))
        new = slice(self._end, self._end + len(stamps))
        self._stamps[new] = stamps
        self._readings[new, :3] = samples.gyro[finite]
        self._readings[new, 3:] = samples.accelerometer[finite]
        self._end += len(stamps)

    def _make_room(self, count: int) -> None:
        """Move what is kept to the front, into twice the space if it fills more than half."""
        if self._end + count <= len(self._stamps):
            return
        kept = slice(self._start, self._end)
        capacity = max(FIRST_CAPACITY, 2 * (len(self) + count))
        stamps, readings = np.empty(capacity, np.int64), np.empty((capacity, 6))
        stamps[: len(self)] = self._stamps[kept]
        readings[: len(self)] = self._readings[kept]
        self._stamps, self._readings = stamps, readings
        self._start, self._end = 0, len(self)

    def covers(self, start_ns: int, end_ns: int) -> bool:
        """Whether samples reach from `start_ns` to `end_ns`; holes inside are not looked for. The
        nearest sample may be held for `MAX_HELD_S` beyond either end."""
        if not len(self):
            return False
        held = int(MAX_HELD_S * 1e9)
        oldest, newest = self._stamps[self._start], self._stamps[self._end - 1]
        return bool(oldest <= start_ns + held and newest >= end_ns - held)

    def preintegrate(
        self, start_ns: int, end_ns: int, gyro_bias: Vector, accelerometer_bias: Vector
    ) -> Preintegration:
        """The motion between two times.

        Readings at the two times are interpolated between their neighbours; where one is
        missing, the nearest is held. Look at `covers` and `Preintegration.longest_gap_s`.

        Args:
            start_ns, end_ns: Start and end on the IMU's clock [ns].
            gyro_bias, accelerometer_bias: (3,) biases to subtract [rad/s], [m/s^2].

        Raises:
            ValueError: There are no samples, or the times do not increase.
        """
        if end_ns <= start_ns or not len(self):
            raise ValueError(f"nothing to integrate from {start_ns} to {end_ns} ns")
        kept = slice(self._start, self._end)
        gyro_bias, accelerometer_bias = np.array(gyro_bias), np.array(accelerometer_bias)
        rotation, velocity, position, jacobians, covariance, gap = preintegrate(
            self._stamps[kept],
            self._readings[kept],
            start_ns,
            end_ns,
            gyro_bias,
            accelerometer_bias,
            self._noise.gyro_noise_density,
            self._noise.accelerometer_noise_density,
        )
        for array in (rotation, velocity, position, jacobians, covariance):
            array.flags.writeable = False
        gyro_bias.flags.writeable = accelerometer_bias.flags.writeable = False
        duration_s = (end_ns - start_ns) * 1e-9
        return Preintegration(
            duration_s,
            rotation,
            velocity,
            position,
            jacobians[0],
            jacobians[1],
            jacobians[2],
            jacobians[3],
            jacobians[4],
            covariance,
            gyro_bias,
            accelerometer_bias,
            self._noise.gyro_bias_walk * duration_s**0.5,
            self._noise.accelerometer_bias_walk * duration_s**0.5,
            gap,
        )

    def between(self, start_ns: int, end_ns: int) -> ImuSamples:
        """The samples with start_ns < stamp <= end_ns."""
        kept = self._stamps[self._start : self._end]
        lo, hi = self._start + np.searchsorted(kept, [start_ns, end_ns], side="right")
        return ImuSamples(
            self._stamps[lo:hi].copy(),
            self._readings[lo:hi, :3].copy(),
            self._readings[lo:hi, 3:].copy(),
        )

    def mean_between(self, start_ns: int, end_ns: int) -> tuple[Vector, Vector] | None:
        """(3,) mean gyro and accelerometer readings; None where there is no sample."""
        samples = self.between(start_ns, end_ns)
        if len(samples.stamps_ns) == 0:
            return None
        return samples.gyro.mean(axis=0), samples.accelerometer.mean(axis=0)

    def forget_before(self, stamp_ns: int) -> None:
        """Drop samples that no motion from `stamp_ns` on needs."""
        kept = self._stamps[self._start : self._end]
        # The last one before it stays, to interpolate from.
        self._start += max(int(np.searchsorted(kept, stamp_ns, side="right")) - 1, 0)

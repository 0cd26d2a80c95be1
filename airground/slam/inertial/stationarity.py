"""Whether the robot stands still, and what a robot at rest knows at once."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from airground.core.arrays import F64
from airground.core.messages import ImuNoise, ImuSamples
from airground.slam.inertial.preintegration import GRAVITY

MIN_SAMPLES = 10
WIDER_THAN_NOISE = 2.0
"""At rest the readings spread no more than this times the sensor's own noise."""
GYRO_FLOOR = 2e-3
"""Spread that counts as rest for any sensor [rad/s]: a standing robot vibrates."""
ACCELEROMETER_FLOOR = 0.03
"""Spread of the accelerometer that counts as rest for any sensor [m/s^2]."""
MAX_RATE = 0.1
"""More than a bias of any gyro that is worth using: turning steadily is no rest [rad/s]."""
MAX_OFF_GRAVITY = 0.3
"""More than the bias of any accelerometer: pushed steadily is no rest [m/s^2]."""


@dataclass(frozen=True, eq=False)
class Rest:
    """What the IMU read while the robot stood still.

    Attributes:
        gyro: (3,) mean: the gyro's bias [rad/s].
        specific_force: (3,) mean: up, in the rig, and the accelerometer's bias [m/s^2].
    """

    gyro: F64
    specific_force: F64

    @property
    def accelerometer_bias(self) -> F64:
        """(3,) bias along gravity [m/s^2]; across gravity it cannot be observed."""
        strength = float(np.linalg.norm(self.specific_force))
        return self.specific_force * (1.0 - GRAVITY / strength)


def at_rest(samples: ImuSamples, noise: ImuNoise) -> Rest | None:
    """The means of a run of samples if the robot stood still all the while, else None.

    Only the spread of the samples is decisive: a hovering robot sways and a flying one shakes,
    while the mean is the same at rest and in even motion. One second of samples suffices.
    """
    if len(samples.stamps_ns) < MIN_SAMPLES:
        return None
    seconds = (samples.stamps_ns[-1] - samples.stamps_ns[0]) * 1e-9
    root_rate = np.sqrt((len(samples.stamps_ns) - 1) / seconds)
    gyro_limit = max(WIDER_THAN_NOISE * noise.gyro_noise_density * root_rate, GYRO_FLOOR)
    force_limit = max(
        WIDER_THAN_NOISE * noise.accelerometer_noise_density * root_rate, ACCELEROMETER_FLOOR
    )
    gyro, force = samples.gyro.mean(axis=0), samples.accelerometer.mean(axis=0)
    still = (
        samples.gyro.std(axis=0).max() < gyro_limit
        and samples.accelerometer.std(axis=0).max() < force_limit
        and np.linalg.norm(gyro) < MAX_RATE
        and abs(np.linalg.norm(force) - GRAVITY) < MAX_OFF_GRAVITY
    )
    return Rest(gyro, force) if still else None


def gravity_aligned(mean_specific_force: F64, forward_hint: F64) -> F64:
    """(3, 3) `R_map_imu` of a map whose z axis points up and whose heading is the hint's.

    Args:
        mean_specific_force: (3,) mean specific force at rest, upwards in the IMU's frame.
        forward_hint: (3,) direction in the IMU's frame that is to lie over the map's +x. A
            map begins with the camera's x axis there, `T_imu_camera.rotation[:, 0]`.

    Raises:
        ValueError: The hint is vertical, or one of the two is zero.
    """
    up_length, hint_length = np.linalg.norm(mean_specific_force), np.linalg.norm(forward_hint)
    up = mean_specific_force / up_length
    across = forward_hint - (forward_hint @ up) * up
    length = np.linalg.norm(across)
    if not length > 1e-6 * hint_length:
        raise ValueError("the heading's hint must not be vertical, and neither vector zero")
    x = across / length
    return np.stack([x, np.cross(up, x), up])

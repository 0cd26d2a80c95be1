"""What goes into bundle adjustment and what comes out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum

import numpy as np

from airground.core.arrays import F64, I64, Mask, freeze
from airground.slam.inertial.preintegration import Preintegration


class Role(IntEnum):
    """The role of a keyframe in the adjustment."""

    FREE = 0
    FIXED = 1
    GAUGE = 2
    """Position and heading are held, so that the map stays in place; the tilt is free."""


@dataclass(frozen=True, eq=False)
class States:
    """K keyframes in order of time.

    Attributes:
        rotations, positions: (K, 3, 3) and (K, 3) `T_map_rig` [m].
        velocities: (K, 3) in the map [m/s].
        gyro_biases, accelerometer_biases: (K, 3) [rad/s], [m/s^2].
        still: (K,) bool, whether the robot was at rest; None for no keyframe.

    Raises:
        ValueError: A shape is wrong or a number is not finite.
    """

    rotations: F64
    positions: F64
    velocities: F64
    gyro_biases: F64
    accelerometer_biases: F64
    still: Mask | None = None

    def __post_init__(self) -> None:
        freeze(self, "rotations", (None, 3, 3), np.float64)
        vectors = ("positions", "velocities", "gyro_biases", "accelerometer_biases")
        for name in vectors:
            freeze(self, name, (len(self), 3), np.float64)
        for name in ("rotations", *vectors):
            array = getattr(self, name)
            if not np.isfinite(array).all():
                raise ValueError(f"{name}: keyframe {_first_bad(array)} is not finite")
        if self.still is not None:
            freeze(self, "still", (len(self),), np.bool_)

    def __len__(self) -> int:
        return len(self.rotations)


@dataclass(frozen=True, eq=False)
class Observations:
    """M sightings of points; a keyframe sees a point at most once.

    Attributes:
        keyframes, points: (M,) int64, indices.
        pixels: (M, 2) observed pixels [px].
        sigmas_px: (M,) standard deviation of each coordinate [px].
        inverse_depths: (M,) measured inverse depths along the optical axis [1/m]; NaN without one.
        inverse_depth_sigmas: (M,) standard deviations [1/m]; not read without an inverse depth.

    Raises:
        ValueError: A shape is wrong, a pixel is not finite, or a sigma is not positive.
    """

    keyframes: I64
    points: I64
    pixels: F64
    sigmas_px: F64
    inverse_depths: F64
    inverse_depth_sigmas: F64

    def __post_init__(self) -> None:
        for name in ("keyframes", "points"):
            freeze(self, name, (len(self),), np.int64)
        freeze(self, "pixels", (len(self), 2), np.float64)
        for name in ("sigmas_px", "inverse_depths", "inverse_depth_sigmas"):
            freeze(self, name, (len(self),), np.float64)
        if not np.isfinite(self.pixels).all():
            raise ValueError(f"pixels: observation {_first_bad(self.pixels)} is not finite")
        if not (self.sigmas_px > 0).all():
            raise ValueError("sigmas_px must be positive")
        if not ((self.inverse_depth_sigmas > 0) | np.isnan(self.inverse_depths)).all():
            raise ValueError("inverse_depth_sigmas must be positive where there is a depth")

    def __len__(self) -> int:
        return len(self.keyframes)


@dataclass(frozen=True, eq=False)
class InertialFactor:
    """Inertial motion between the stamps of keyframes `first` and `second` = `first` + 1."""

    first: int
    second: int
    preintegration: Preintegration


@dataclass(frozen=True)
class Settings:
    """How to adjust.

    Attributes:
        iterations: Most steps tried: 8 for a window, 15 for a whole map.
        huber: Whitened residual from which a cost grows linearly.
        relative_decrease: A step that lowers the cost by a smaller share is the last one.
        gyro_bias_prior_sigma: Standard deviation of the bias about zero [rad/s], for a keyframe
            that no inertial motion leads to; None for no prior.
        accelerometer_bias_prior_sigma: Like `gyro_bias_prior_sigma`, of the accelerometer [m/s^2].
        still_sigma: Standard deviation of the velocity of a robot at rest [m/s].
        covariance: Whether that of the last free keyframe is wanted: it takes as long as a step.
    """

    iterations: int = 8
    huber: float = 1.5
    relative_decrease: float = 1e-4
    gyro_bias_prior_sigma: float | None = 0.05
    accelerometer_bias_prior_sigma: float | None = 0.3
    still_sigma: float = 0.005
    covariance: bool = True


@dataclass(frozen=True, eq=False)
class Adjustment:
    """What bundle adjustment found.

    Attributes:
        states, points: Keyframes and (P, 3) points [m] at the optimum.
        residuals_px: (M,) distance from where each point was seen to where it should have
            been [px]; NaN behind the camera.
        cost_before, cost_after: Half the sum of squared whitened residuals, linear beyond
            the Huber threshold.
        iterations: Steps tried.
        covariance: (6, 6) covariance of the last FREE keyframe's pose: position [m], rotation
            vector of estimate times inverse truth [rad], in the map's axes. None where there
            is no such keyframe, it is not wanted, or the problem does not determine it.
    """

    states: States
    points: F64
    residuals_px: F64
    cost_before: float
    cost_after: float
    iterations: int
    covariance: F64 | None

    def __post_init__(self) -> None:
        freeze(self, "points", (None, 3), np.float64)
        freeze(self, "residuals_px", (None,), np.float64)
        if self.covariance is not None:
            freeze(self, "covariance", (6, 6), np.float64)


def check(
    states: States,
    roles: I64,
    points: F64,
    observations: Observations,
    inertial: Sequence[InertialFactor],
) -> None:
    """Raise ValueError where the parts of a problem do not fit together."""
    count = len(states)
    if not np.isin(roles, [int(role) for role in Role]).all():
        raise ValueError("roles: expected FREE, FIXED or GAUGE")
    if not np.isfinite(points).all():
        raise ValueError(f"points: point {_first_bad(points)} is not finite")
    for name, indices, size in (
        ("keyframes", observations.keyframes, count),
        ("points", observations.points, len(points)),
    ):
        if len(indices) and not (indices.min() >= 0 and indices.max() < size):
            raise ValueError(f"observations: {name} must lie in 0..{size - 1}")
    for factor in inertial:
        if not 0 <= factor.first == factor.second - 1 < count - 1:
            raise ValueError(
                f"inertial factor {factor.first} to {factor.second}: "
                f"expected neighbours among {count} keyframes"
            )


def _first_bad(array: F64) -> int:
    finite = np.isfinite(array.reshape(len(array), -1)).all(axis=1)
    return int(np.argmin(finite))

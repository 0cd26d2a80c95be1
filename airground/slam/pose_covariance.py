"""The part of a pose's covariance that all images share: scale, vertical and mounting.

Bundle adjustment takes the calibration as exact, so that its covariance lacks these, which are
most of the error.
"""

from __future__ import annotations

import numpy as np

from airground.core.arrays import F64

MOUNTING_SIGMA = np.deg2rad(0.1)
"""Standard deviation of a calibrated mounting per axis [rad]."""
DEPTH_SCALE_SIGMA = 3e-3
"""Relative standard deviation of a depth camera's calibrated scale."""
LEVEL_SIGMA = np.deg2rad(0.3)
"""Standard deviation of the vertical at rest per axis [rad]: an accelerometer bias of 50 mm/s^2."""


def with_shared_errors(covariance: F64, lever: F64, scale_sigma: float, tilt_sigma: float) -> F64:
    """(6, 6) covariance of a pose, errors of the whole map included.

    Args:
        covariance: (6, 6) covariance of position and rotation within the map, in its axes.
        lever: (3,) vector from the map's first pose to the camera [m].
        scale_sigma: Relative standard deviation of the map's scale.
        tilt_sigma: Standard deviation of the map's vertical per axis [rad].
    """
    total = np.array(covariance)
    total[:3, :3] += scale_sigma**2 * np.outer(lever, lever)
    for axis in np.eye(3)[:2]:
        moved = np.concatenate([np.cross(axis, lever), axis])
        total += tilt_sigma**2 * np.outer(moved, moved)
    total[3:, 3:] += MOUNTING_SIGMA**2 * np.eye(3)
    return total

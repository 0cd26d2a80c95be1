"""What a pose owes to errors that every image shares: scale, vertical and mounting.

Bundle adjustment takes the calibration for exact, and so its covariance leaves these out; they
are most of the error.
"""

from __future__ import annotations

import numpy as np

from airground.core.arrays import F64

MOUNTING_SIGMA = np.deg2rad(0.1)
"""How well a camera's mounting is calibrated, per axis [rad]."""
DEPTH_SCALE_SIGMA = 3e-3
"""How well the scale of a depth camera is calibrated [share]."""
LEVEL_SIGMA = np.deg2rad(0.3)
"""How well an accelerometer at rest knows the vertical, per axis: 50 mm/s^2 of bias [rad]."""


def with_shared_errors(covariance: F64, lever: F64, scale_sigma: float, tilt_sigma: float) -> F64:
    """(6, 6) covariance of a pose, errors of the whole map included.

    Args:
        covariance: (6, 6) of position and rotation within the map, in its axes.
        lever: (3,) from where the map began to the camera [m].
        scale_sigma: Of the map's scale [share].
        tilt_sigma: Of its vertical, per axis [rad].
    """
    total = np.array(covariance)
    total[:3, :3] += scale_sigma**2 * np.outer(lever, lever)
    for axis in np.eye(3)[:2]:
        moved = np.concatenate([np.cross(axis, lever), axis])
        total += tilt_sigma**2 * np.outer(moved, moved)
    total[3:, 3:] += MOUNTING_SIGMA**2 * np.eye(3)
    return total

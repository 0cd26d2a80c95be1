"""The errors that all images of a map share, in the covariance of its newest pose.

Bundle adjustment takes scale, vertical and calibration as exact, so that its covariance lacks
what these are off by, which is most of the error."""

from __future__ import annotations

import numpy as np

from airground.core.arrays import F64
from airground.core.messages import CalibrationSigmas

UPRIGHT_AXES = np.eye(3)[:2]
"""A map may be turned about these; its heading is free."""
BENDS_M = 1.5e-3
"""Standard deviation of a position by the bends of the map itself, per axis [m]: adjustment of the
newest keyframes takes the older ones as exact (set on five flights, `nominal` and `harsh`)."""


class SharedErrors:
    """Covariance of a pose by the map's scale and vertical, and by the calibration.

    On its way the robot adds up what scale and vertical were off by at the time: the place where
    it is stays when they become better known, and the past turns about it. So the error of its
    position is that of a walk, of which only the last part goes with today's vertical.

    Args:
        sigmas: How well the calibration is known.
    """

    def __init__(self, sigmas: CalibrationSigmas) -> None:
        self._sigmas = sigmas
        self._position: F64 | None = None
        self._of_position = np.zeros((3, 3))
        # Covariance of the position with tilt about x, tilt about y, and scale; their variances.
        self._with_shared = np.zeros((3, 3))
        self._variances = np.zeros(3)

    def at(self, position: F64, velocity: F64, scale_sigma: float, tilt_sigma: float) -> F64:
        """(6, 6) of position and rotation in the axes of the map, at the next image.

        Args:
            position: (3,) position of the camera in the map [m]; the map begins at the first one.
            velocity: (3,) its velocity [m/s].
            scale_sigma: Relative standard deviation of the map's scale now.
            tilt_sigma: Standard deviation of the map's vertical per axis now [rad].
        """
        variances = np.array([tilt_sigma, tilt_sigma, scale_sigma]) ** 2
        if self._position is not None:
            # What is learnt of an error is independent of what remains of it.
            kept = np.minimum(variances / np.maximum(self._variances, 1e-30), 1.0)
            self._walk(position - self._position, self._with_shared * kept, variances)
        self._position, self._variances = np.array(position), variances
        total = np.zeros((6, 6))
        late = self._sigmas.clock_s * velocity
        total[:3, :3] = self._of_position + np.outer(late, late) + BENDS_M**2 * np.eye(3)
        total[:3, 3:5] = self._with_shared[:, :2]
        total[3:5, :3] = self._with_shared[:, :2].T
        total[3:, 3:] = np.diag([*variances[:2], 0.0]) + self._sigmas.mounting_rad**2 * np.eye(3)
        return total

    def _walk(self, step: F64, with_shared: F64, variances: F64) -> None:
        """Add the errors of a step (3,) [m]."""
        turned = (np.cross(axis, step) for axis in UPRIGHT_AXES)
        by_shared = np.column_stack([*turned, step])
        both = by_shared @ with_shared.T
        self._of_position = self._of_position + both + both.T + by_shared * variances @ by_shared.T
        self._with_shared = with_shared + by_shared * variances

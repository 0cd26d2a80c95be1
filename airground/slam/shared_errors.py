"""The errors that all images of a map share, in the covariance of its newest pose.

Bundle adjustment takes scale, vertical and calibration as exact, so that its covariance lacks
what these are off by, which is most of the error."""

from __future__ import annotations

import numpy as np

from airground.core.arrays import F64
from airground.core.messages import CalibrationSigmas
from airground.core.se3 import SE3

HEADING_WALK = 0.9e-3
"""The heading of a map drifts as its robot turns: standard deviation after a turn of a radian, to
whatever side [rad] (measured on four paths of each robot, `nominal`)."""
BENDS_M = 1.5e-3
"""Standard deviation of a position by the bends of the map itself, per axis [m]: adjustment of the
newest keyframes takes the older ones as exact (set on five flights, `nominal` and `harsh`)."""


class SharedErrors:
    """Covariance of a pose by the map's scale, vertical and heading, and by the calibration.

    On its way the robot adds up what scale and vertical were off by at the time: the place where
    it is stays when they become better known, and the past turns about it. So the error of its
    position is that of a walk, of which only the last part goes with today's vertical. The heading
    begins free, so that it is right; it becomes less known as the robot turns.

    Args:
        sigmas: How well the calibration is known.
    """

    def __init__(self, sigmas: CalibrationSigmas) -> None:
        self._sigmas = sigmas
        self._pose: SE3 | None = None
        self._turned_rad = 0.0
        self._of_position = np.zeros((3, 3))
        # Covariance of the position with turns about x, y and z, and scale; their variances.
        self._with_shared = np.zeros((3, 4))
        self._variances = np.zeros(4)

    def at(self, T_map_camera: SE3, velocity: F64, scale_sigma: float, tilt_sigma: float) -> F64:
        """(6, 6) of position and rotation in the axes of the map, at the next image.

        Args:
            T_map_camera: Pose of the camera; the map begins at the first one.
            velocity: (3,) its velocity in the map [m/s].
            scale_sigma: Relative standard deviation of the map's scale now.
            tilt_sigma: Standard deviation of the map's vertical per axis now [rad].
        """
        before, self._pose = self._pose, T_map_camera
        if before is not None:
            turn = before.inverse() @ T_map_camera
            self._turned_rad += float(np.linalg.norm(turn.rotation_vector()))
        heading_sigma = HEADING_WALK * np.sqrt(self._turned_rad)
        variances = np.array([tilt_sigma, tilt_sigma, heading_sigma, scale_sigma]) ** 2
        if before is not None:
            # What is learnt of an error is independent of what remains of it; what is added, too.
            kept = np.minimum(variances / np.maximum(self._variances, 1e-30), 1.0)
            step = T_map_camera.translation - before.translation
            self._walk(step, self._with_shared * kept, variances)
        self._variances = variances
        total = np.zeros((6, 6))
        late = self._sigmas.clock_s * velocity
        total[:3, :3] = self._of_position + np.outer(late, late) + BENDS_M**2 * np.eye(3)
        total[:3, 3:] = self._with_shared[:, :3]
        total[3:, :3] = self._with_shared[:, :3].T
        total[3:, 3:] = np.diag(variances[:3]) + self._sigmas.mounting_rad**2 * np.eye(3)
        return total

    def _walk(self, step: F64, with_shared: F64, variances: F64) -> None:
        """Add the errors of a step (3,) [m]."""
        turned = (np.cross(axis, step) for axis in np.eye(3))
        by_shared = np.column_stack([*turned, step])
        both = by_shared @ with_shared.T
        self._of_position = self._of_position + both + both.T + by_shared * variances @ by_shared.T
        self._with_shared = with_shared + by_shared * variances

"""The true pose of the MAV relative to the ground robot, and how far an estimate is off.

No alignment is applied: the error is what a user of the pose gets. Both robots' maps enter
as the front ends made them, so drift counts.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike

from airground.core.belief import Belief
from airground.core.se3 import SE3
from airground.pipeline import Sighting
from sim.truth import Truth


@dataclass(frozen=True)
class PoseError:
    """Error of the MAV's camera pose relative to the ground robot's camera.

    Attributes:
        horizontal_m: Distance in the horizontal plane [m], as for the particles (Fig. 11).
        translation_m: Distance in space [m] (Fig. 13).
        rotation_deg: Angle of the rotation between truth and estimate [deg] (Fig. 14).
    """

    horizontal_m: float
    translation_m: float
    rotation_deg: float


class BothPoses(Protocol):
    """Where both cameras were, as their front ends said; a `Sighting` tells it."""

    @property
    def mav_stamp_ns(self) -> int: ...
    @property
    def T_mav_camera(self) -> SE3: ...
    @property
    def ground_stamp_ns(self) -> int: ...
    @property
    def T_ground_camera(self) -> SE3: ...


def true_T_ground_mav(poses: BothPoses, truth: Truth) -> SE3:
    """The motion between the maps that makes the robots' relative pose at that time exact."""
    T_world_ground_camera = truth.T_world_ground_camera(poses.ground_stamp_ns)
    T_world_mav_camera = truth.T_world_mav_camera(poses.mav_stamp_ns)
    T_ground_camera_mav_camera = T_world_ground_camera.inverse() @ T_world_mav_camera
    return poses.T_ground_camera @ T_ground_camera_mav_camera @ poses.T_mav_camera.inverse()


def pose_error(T_ground_mav: SE3, poses: BothPoses, truth: Truth) -> PoseError:
    """How far an estimate puts the MAV's camera from where it is."""
    true = true_T_ground_mav(poses, truth) @ poses.T_mav_camera
    estimate = T_ground_mav @ poses.T_mav_camera
    off = estimate.translation - true.translation
    return PoseError(
        float(np.linalg.norm(off[:2])),
        float(np.linalg.norm(off)),
        float(np.rad2deg((true.inverse() @ estimate).angle())),
    )


def squared_mahalanobis(belief: Belief, sighting: Sighting, truth: Truth) -> float:
    """How many standard deviations, squared, the truth lies from what a belief reports.

    It is told where the particles live: at the camera that the surface was seen from.

    Returns:
        d^T P^-1 d of the horizontal error d and the particles' covariance P; infinite where
        they are all in one line or place, so that they leave nothing else possible.
    """
    position_mav = sighting.surface.T_mav_camera.translation
    true_position = true_T_ground_mav(sighting, truth) @ position_mav
    return distance_in(belief.covariance, belief.estimate[:2] - true_position[:2])


def distance_in(covariance: ArrayLike, error: ArrayLike) -> float:
    """Squared Mahalanobis distance of an error (2,) [m] in a covariance (2, 2) [m^2]."""
    matrix, difference = np.asarray(covariance, np.float64), np.asarray(error, np.float64)
    eigenvalues = np.linalg.eigvalsh(matrix)
    if not eigenvalues[0] > np.finfo(np.float64).eps * max(eigenvalues[1], 1.0):
        return float("inf")
    return float(difference @ np.linalg.solve(matrix, difference))

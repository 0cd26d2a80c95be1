"""The true pose of the MAV relative to the ground robot, and how far an estimate is off.

No alignment is applied: the error is what a user of the pose gets. Both robots' maps enter
as the front ends made them, so drift counts.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from airground.core.se3 import SE3
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

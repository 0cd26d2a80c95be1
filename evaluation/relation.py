"""The true pose of the MAV relative to the ground robot, and how far an estimate is off.

No alignment is applied: the error is what a user of the pose gets. Both robots' maps enter
as the front ends made them, so drift counts.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

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


def true_T_ground_mav(sighting: Sighting, truth: Truth) -> SE3:
    """The motion between the maps that makes the robots' relative pose at that time exact."""
    T_world_ground_camera = truth.T_world_ground_camera(sighting.ground_stamp_ns)
    T_world_mav_camera = truth.T_world_mav_camera(sighting.mav_stamp_ns)
    T_ground_camera_mav_camera = T_world_ground_camera.inverse() @ T_world_mav_camera
    return sighting.T_ground_camera @ T_ground_camera_mav_camera @ sighting.T_mav_camera.inverse()


def pose_error(T_ground_mav: SE3, sighting: Sighting, truth: Truth) -> PoseError:
    """How far an estimate puts the MAV's camera from where it is."""
    true = true_T_ground_mav(sighting, truth) @ sighting.T_mav_camera
    estimate = T_ground_mav @ sighting.T_mav_camera
    off = estimate.translation - true.translation
    return PoseError(
        float(np.linalg.norm(off[:2])),
        float(np.linalg.norm(off)),
        float(np.rad2deg((true.inverse() @ estimate).angle())),
    )

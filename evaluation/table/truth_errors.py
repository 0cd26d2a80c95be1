"""Errors against the truth: of an estimated relation between both robots, and of a surface."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from airground.core.belief import Belief
from airground.core.camera import PinholeCamera
from airground.core.se3 import SE3
from airground.core.sighting import Sighting
from sim.recording.truth import Truth


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
    """Poses of both cameras by their front ends, for example a `Sighting`."""

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
    return relative_error(T_ground_mav, true_T_ground_mav(poses, truth), poses.T_mav_camera)


def relative_error(T_ground_mav: SE3, reference: SE3, T_mav_camera: SE3) -> PoseError:
    """How far two relations between the maps put the MAV's camera apart."""
    true = reference @ T_mav_camera
    estimate = T_ground_mav @ T_mav_camera
    off = estimate.translation - true.translation
    return PoseError(
        float(np.linalg.norm(off[:2])),
        float(np.linalg.norm(off)),
        float(np.rad2deg((true.inverse() @ estimate).angle())),
    )


def squared_mahalanobis(belief: Belief, sighting: Sighting, truth: Truth) -> float:
    """Squared Mahalanobis distance of the truth from a belief.

    The error is that of the particles: at the camera that the surface was seen from.

    Returns:
        d^T P^-1 d of the horizontal error d and the belief's covariance P; infinite where
        P has no extent in some direction.
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


@dataclass(frozen=True)
class SurfaceError:
    """Distances of a depth map's points to the true surface.

    Attributes:
        error_m: (height, width) float64 [m], NaN where the map has no depth.
        median_m, p90_m: Of those that are finite [m]; NaN for an empty map.
        completeness: Share of the pixels that have a depth.
    """

    error_m: NDArray[np.float64]
    median_m: float
    p90_m: float
    completeness: float


def surface_error(
    depth: NDArray[np.float32], camera: PinholeCamera, T_world_camera: SE3, truth: Truth
) -> SurfaceError:
    """Compare a depth map of the MAV with the surface that it saw, point by nearest point.

    Args:
        depth: (height, width) [m], NaN where missing.
        camera: Nominal camera of the pipeline, with its calibration errors.
        T_world_camera: Where the reference view truly was, so that errors of the poses'
            drift do not count here.
        truth: The scene.
    """
    seen = np.isfinite(depth)
    error = np.full(depth.shape, np.nan)
    if not seen.any():
        return SurfaceError(error, np.nan, np.nan, 0.0)
    points_camera = camera.back_project(depth.astype(np.float64))[seen]
    error[seen] = np.abs(truth.surface("mav").distance(T_world_camera @ points_camera))
    return SurfaceError(
        error,
        float(np.median(error[seen])),
        float(np.quantile(error[seen], 0.9)),
        float(seen.mean()),
    )


def depth_error(
    depth: NDArray[np.float32], camera: PinholeCamera, stamp_ns: int, truth: Truth
) -> NDArray[np.float32]:
    """(height, width) depth minus true depth [m] of the MAV's view, NaN where one is missing."""
    true = truth.surface("mav").cast(camera, truth.T_world_mav_camera(stamp_ns))
    return (depth - true).astype(np.float32)

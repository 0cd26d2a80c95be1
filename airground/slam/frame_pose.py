"""The pose of one image from the map points that were followed into it."""

from __future__ import annotations

import cv2
import numpy as np

from airground.core.arrays import F64, Mask
from airground.core.camera import PinholeCamera
from airground.core.se3 import SE3, nearest_rotation
from airground.slam.geometry.pose_estimation import PoseFit, estimate_pose
from airground.slam.geometry.translation_ransac import translation_by_known_rotation

RANSAC_ROUNDS = 50
RANSAC_THRESHOLD_PX = 3.0
BLUR = 3.0
"""In a smeared image, or one whose rows were taken one after the other in a fast turn, corners
are this many times less certain."""
MIN_SHARE = 0.4
"""A pose that fewer of the points agree on is chance."""
PNP_ROUNDS = 100


def frame_pose(
    points_map: F64,
    pixels: F64,
    camera: PinholeCamera,
    T_map_camera_predicted: SE3,
    *,
    sigma_px: float,
    rotation_sigma: float | None,
    position_sigma: float | None,
    min_points: int,
    rng: np.random.Generator,
    inverse_depths: F64 | None = None,
    inverse_depth_sigma: float = 1.0,
) -> PoseFit | None:
    """Reject outliers, by the known rotation where there is a gyro, and fit the rest.

    Args:
        points_map: (N, 3) map points [m].
        pixels: (N, 2) pixels of the points in the image.
        sigma_px: Standard deviation of a pixel per axis [px].
        rotation_sigma: How well the predicted rotation is known [rad]; None if it is not.
        position_sigma: How well the predicted position is known [m]; None if it is not.
        min_points: Least number of inliers of a pose.
        inverse_depths: (N,) measured inverse depths [1/m], NaN without one; None without any.
        inverse_depth_sigma: Standard deviation of the inverse depths [1/m].

    Returns:
        The fit, its `inliers` over all N; None where the image does not determine the pose.
    """
    if len(points_map) < min_points:
        return None
    depths = np.full(len(points_map), np.nan) if inverse_depths is None else inverse_depths
    for blur in (1.0, BLUR):
        start, chosen = _consensus(
            points_map,
            pixels,
            camera,
            T_map_camera_predicted,
            rotation_sigma,
            blur * RANSAC_THRESHOLD_PX,
            rng,
        )
        if start is None or chosen.sum() < min_points:
            continue
        count = int(chosen.sum())
        fit = estimate_pose(
            points_map[chosen],
            pixels[chosen],
            np.full(count, blur * sigma_px),
            camera,
            start,
            inverse_depths=depths[chosen],
            inverse_depth_sigmas=np.full(count, inverse_depth_sigma),
            rotation_sigma=rotation_sigma,
            position_sigma=position_sigma,
            # With a gyro, the two-point start has the known rotation already.
            T_map_camera_prior=T_map_camera_predicted if rotation_sigma is None else None,
        )
        if fit.inliers.sum() >= min_points and fit.inliers.sum() >= MIN_SHARE * len(points_map):
            inliers = np.zeros(len(points_map), bool)
            inliers[np.flatnonzero(chosen)[fit.inliers]] = True
            return PoseFit(fit.T_map_camera, inliers, fit.rms_px, fit.covariance, fit.iterations)
    return None


def _consensus(
    points_map: F64,
    pixels: F64,
    camera: PinholeCamera,
    predicted: SE3,
    rotation_sigma: float | None,
    threshold_px: float,
    rng: np.random.Generator,
) -> tuple[SE3 | None, Mask]:
    """A pose that many points agree on, and which."""
    if rotation_sigma is not None:
        return translation_by_known_rotation(
            points_map, pixels, camera, predicted.rotation, threshold_px, RANSAC_ROUNDS, rng
        )
    T_camera_map = predicted.inverse()
    found, turn, shift, rows = cv2.solvePnPRansac(
        points_map,
        pixels,
        camera.matrix(),
        None,
        rvec=T_camera_map.rotation_vector().reshape(3, 1),
        tvec=T_camera_map.translation.reshape(3, 1).copy(),
        useExtrinsicGuess=True,
        iterationsCount=PNP_ROUNDS,
        reprojectionError=threshold_px,
        flags=cv2.SOLVEPNP_ITERATIVE,
    )
    chosen = np.zeros(len(points_map), bool)
    if not found or rows is None:
        return None, chosen
    chosen[rows.ravel()] = True
    rotation = nearest_rotation(cv2.Rodrigues(turn)[0])
    return SE3(rotation, shift.ravel().astype(np.float64)).inverse(), chosen

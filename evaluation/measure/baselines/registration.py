"""Common parts of baselines on point clouds: the searched map, ICP, and whether it is claimed."""

from __future__ import annotations

import numpy as np
import small_gicp
from numpy.typing import NDArray

from airground.core.se3 import SE3
from evaluation.measure.baselines.interface import Answer, Given

MIN_POINTS = 200
VOXEL_M = 0.05
"""Clouds are thinned to this for features: a tenth of the boxes' sides [m]."""
NORMAL_RADIUS_M, FEATURE_RADIUS_M = 3 * VOXEL_M, 5 * VOXEL_M
"""As KISS-Matcher and Open3D's global registration recommend."""
MAX_TURN_DEG = 15.0
"""Both maps have z up, and magnetometers give their headings: a motion turned by more is wrong."""


def searched_ground(given: Given) -> NDArray[np.float64]:
    """(N, 3) the ground robot's points [m] as far as the search region and the MAV's view reach."""
    sighting = given.sighting
    surface = sighting.surface
    from_camera = surface.cloud_mav.points - surface.T_mav_camera.translation
    view_m = np.linalg.norm(from_camera[:, :2], axis=1).max(initial=0.0)
    reach_m = given.config.localization.search_radius_m + view_m
    points = sighting.ground_cloud.points
    near = np.abs(points[:, :2] - sighting.T_ground_camera.translation[:2]) <= reach_m
    return points[near.all(axis=1)].astype(np.float64)


def thinned(points: NDArray, voxel_m: float) -> NDArray[np.float64]:
    """(M, 3) the mean of the points (N, 3) in each cube [m]; the same on any number of threads."""
    return np.array(_sampled(points, voxel_m).points()[:, :3])


def _sampled(points: NDArray, voxel_m: float) -> small_gicp.PointCloud:
    return small_gicp.voxelgrid_sampling(np.asarray(points, np.float64), voxel_m, num_threads=1)


def settled_by_icp(given: Given, start: SE3) -> Answer:
    """Point-to-plane ICP of small_gicp, at the distances of ours: first wide, then narrow.
    Claimed if the share of aerial points on the ground map reaches the least overlap, inside the
    search region, with the rotation that gravity and the magnetometers give."""
    refinement = given.config.refinement
    aerial = _sampled(given.sighting.surface.cloud_mav.points, refinement.voxel_m)
    ground = _sampled(searched_ground(given), refinement.voxel_m)
    tree = small_gicp.KdTree(ground, num_threads=1)
    small_gicp.estimate_normals(ground, tree, num_threads=1)
    motion = start
    for distance_m in (refinement.max_distance_m, refinement.final_distance_m):
        result = small_gicp.align(
            ground,
            aerial,
            tree,
            init_T_target_source=motion.matrix(),
            registration_type="PLANE_ICP",
            max_correspondence_distance=distance_m,
            num_threads=1,
            max_iterations=refinement.iterations,
        )
        if not np.isfinite(result.T_target_source).all():
            return Answer(motion, "ICP found no finite motion")
        motion = SE3.from_matrix(result.T_target_source)
    share = result.num_inliers / max(aerial.size(), 1)
    return Answer(motion, why_refused(given, motion, share))


def why_refused(given: Given, motion: SE3, share: float) -> str:
    """Reason why a registered T_ground_mav is not claimed; empty if it is.
    `share` is that of the aerial points that lie on the ground map."""
    least = given.config.localization.min_overlap
    if share < least:
        return f"only {share:.0%} of the aerial points lie on the ground map, {least:.0%} needed"
    turn_deg = np.rad2deg(impossible_turn(given, motion.rotation[None])[0])
    if turn_deg > MAX_TURN_DEG:
        return f"turned by {turn_deg:.0f} deg from what gravity and the magnetometers say"
    camera = motion @ given.sighting.surface.T_mav_camera.translation
    off = np.abs(camera[:2] - given.sighting.T_ground_camera.translation[:2]).max()
    if off > given.config.localization.search_radius_m:
        return "the place lies outside of the search region"
    return ""


def impossible_turn(given: Given, rotations: NDArray) -> NDArray[np.float64]:
    """(N,) angle between rotations (N, 3, 3) of `mav` to `ground` and the known one [rad].
    If the heading is searched or unknown, only the vertical is known."""
    heading = given.sighting.heading
    if given.config.localization.heading == "search" or heading is None:
        cosines = rotations[:, 2, 2]
    else:
        known = SE3.from_heading(heading).rotation
        cosines = ((rotations * known).sum(axis=(1, 2)) - 1) / 2
    return np.arccos(np.clip(cosines, -1, 1))


def too_few_points(given: Given) -> str:
    """Reason if a cloud is too small to register; empty otherwise."""
    for name, count in (
        ("aerial", len(given.sighting.surface.cloud_mav)),
        ("ground", len(searched_ground(given))),
    ):
        if count < MIN_POINTS:
            return f"the {name} cloud has {count} points, at least {MIN_POINTS} are needed"
    return ""


def icp_from_prior(given: Given) -> Answer:
    """Point-to-plane ICP started at the prior."""
    if given.prior is None:
        return Answer(None, "there is no prior to start from")
    refusal = too_few_points(given)
    if refusal:
        return Answer(given.prior, refusal)
    return settled_by_icp(given, given.prior)

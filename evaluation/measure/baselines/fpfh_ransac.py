"""FPFH features with RANSAC (Rusu et al., ICRA 2009), then ICP."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import open3d as o3d
from numpy.typing import NDArray

from airground.core.se3 import SE3
from evaluation.measure.baselines.interface import Answer, Given
from evaluation.measure.baselines.registration import (
    FEATURE_RADIUS_M,
    MAX_TURN_DEG,
    NORMAL_RADIUS_M,
    VOXEL_M,
    impossible_turn,
    searched_ground,
    settled_by_icp,
    thinned,
    too_few_points,
)

SAMPLES = 100_000
"""Number of triples of matches that are tried."""
EDGE_SIMILARITY = 0.9
"""Least ratio of the sides of a triple's two triangles, as in Open3D's checker."""
INLIER_M = 1.5 * VOXEL_M
MIN_MATCHES = 10
SCORED_AT_ONCE = 256


def fpfh_ransac_icp(given: Given) -> Answer:
    """Match features both ways, take the possible motion with most inliers, and refine by ICP.
    RANSAC is implemented here: Open3D's result depends on the number of threads."""
    refusal = too_few_points(given)
    if refusal:
        return Answer(None, refusal)
    aerial = _featured(given.sighting.surface.cloud_mav.points)
    ground = _featured(searched_ground(given))
    matches = np.asarray(
        o3d.pipelines.registration.correspondences_from_features(
            aerial[1], ground[1], mutual_filter=True
        )
    )
    if len(matches) < MIN_MATCHES:
        return Answer(None, f"{len(matches)} features match, at least {MIN_MATCHES} are needed")
    start = ransac(
        aerial[0][matches[:, 0]],
        ground[0][matches[:, 1]],
        lambda rotations: impossible_turn(given, rotations) < np.deg2rad(MAX_TURN_DEG),
        given.rng,
    )
    if start is None:
        return Answer(None, "no three matches fit a motion that gravity and heading allow")
    return settled_by_icp(given, start)


def _featured(points: NDArray) -> tuple[NDArray[np.float64], o3d.pipelines.registration.Feature]:
    """Thinned points (M, 3) and their features, normals turned up."""
    kept = thinned(points, VOXEL_M)
    cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(kept))
    search = o3d.geometry.KDTreeSearchParamHybrid
    cloud.estimate_normals(search(NORMAL_RADIUS_M, 30))
    cloud.orient_normals_to_align_with_direction((0.0, 0.0, 1.0))
    features = o3d.pipelines.registration.compute_fpfh_feature(
        cloud,
        search(FEATURE_RADIUS_M, 100),
    )  # type: ignore[call-arg]  # its stub lacks a default
    return kept, features


def ransac(
    source: NDArray,
    target: NDArray,
    possible: Callable[[NDArray], NDArray[np.bool_]],
    rng: np.random.Generator,
) -> SE3 | None:
    """T_target_source that brings most source points near their target points (N, 3) [m].
    It is fitted to its inliers; None where no triple of points gives a motion with a `possible`
    rotation, of an array (B, 3, 3)."""
    triples = rng.integers(0, len(source), (SAMPLES, 3))
    alike = _edges(source[triples]), _edges(target[triples])
    similar = np.minimum(*alike) >= EDGE_SIMILARITY * np.maximum(*alike)
    # A triangle of coinciding points constrains nothing.
    similar &= np.minimum(*alike) > 2 * VOXEL_M
    triples = triples[similar.all(axis=1)]
    rotations, translations = _rigid_motions(source[triples], target[triples])
    kept = possible(rotations)
    rotations, translations = rotations[kept], translations[kept]
    if len(rotations) == 0:
        return None
    counts = np.concatenate(
        [
            _near(rotations[i : i + SCORED_AT_ONCE], translations[i : i + SCORED_AT_ONCE],
                  source, target).sum(axis=1)
            for i in range(0, len(rotations), SCORED_AT_ONCE)
        ]
    )  # fmt: skip
    best = int(np.argmax(counts))
    inlier = _near(rotations[best][None], translations[best][None], source, target)[0]
    rotation, translation = _rigid_motions(source[inlier][None], target[inlier][None])
    return SE3(rotation[0], translation[0])


def _edges(triangles: NDArray) -> NDArray[np.float64]:
    """(B, 3) lengths of the sides of triangles (B, 3, 3)."""
    return np.linalg.norm(triangles - np.roll(triangles, 1, axis=1), axis=2)


def _near(
    rotations: NDArray, translations: NDArray, source: NDArray, target: NDArray
) -> NDArray[np.bool_]:
    """(K, N) which points K motions bring near their targets."""
    moved = source @ rotations.transpose(0, 2, 1) + translations[:, None]
    return ((moved - target) ** 2).sum(axis=2) < INLIER_M**2


def _rigid_motions(source: NDArray, target: NDArray) -> tuple[NDArray, NDArray]:
    """Least squares (Kabsch): (B, 3, 3) rotations and (B, 3) shifts of point sets (B, n, 3)."""
    mean_source, mean_target = source.mean(axis=1), target.mean(axis=1)
    centred_source = source - mean_source[:, None]
    covariance = (target - mean_target[:, None]).transpose(0, 2, 1) @ centred_source
    u, _, vt = np.linalg.svd(covariance)
    u[:, :, 2] *= np.linalg.det(u @ vt)[:, None]
    rotations = u @ vt
    return rotations, mean_target - (rotations @ mean_source[:, :, None])[:, :, 0]

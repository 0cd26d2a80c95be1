"""From a rough relative pose to a precise one, or a refusal with its reason (Sec. VII)."""

from __future__ import annotations

import numpy as np

from airground.config import Config, Refinement
from airground.core.agreement import agreement
from airground.core.arrays import F32, F64, Mask
from airground.core.belief import Alignment, HeightMap
from airground.core.cloud import PointCloud
from airground.core.height_map import lattice_index, make_height_map
from airground.core.se3 import SE3
from airground.refinement.icp import point_to_plane_icp
from airground.refinement.local_search import search_nearby
from airground.refinement.surfels import Surfels, make_surfels

MIN_POINTS = 200
COVER_CELLS_PER_M = 25.0


def refine(
    stamp_ns: int, T_ground_mav_start: SE3, aerial: PointCloud, ground: PointCloud, config: Config
) -> Alignment:
    """Align an aerial cloud in the frame `mav` with the ground map in the frame `ground`.
    Clouds that are too small or do not overlap give a refusal with the start unchanged."""
    settings = config.refinement
    for name, cloud in (("aerial", aerial), ("ground", ground)):
        if len(cloud) < MIN_POINTS:
            refusal = f"no structure: the {name} cloud has {len(cloud)} points of {MIN_POINTS}"
            return _refused(stamp_ns, T_ground_mav_start, refusal)
    nearby = _nearby(ground.points, T_ground_mav_start @ aerial.points, settings)
    if len(nearby) < MIN_POINTS:
        refusal = "no overlap: the ground map has nothing below the aerial surface"
        return _refused(stamp_ns, T_ground_mav_start, refusal)

    # A better start than the guess, by the height maps nearby.
    start = T_ground_mav_start
    if settings.level_prior:
        start = _levelled(start, aerial.points)
    source = make_surfels(aerial.points, settings.voxel_m)
    if settings.local_search:
        found = search_nearby(source.points, nearby, start, settings)
        if found is None:
            return _refused(stamp_ns, start, "no overlap: height maps share too little nearby")
        start = found

    target = make_surfels(nearby, settings.voxel_m)
    motion = point_to_plane_icp(source.points, target, start, settings)
    return _judged(stamp_ns, motion, source, target, settings)


def _refused(stamp_ns: int, motion: SE3, refusal: str) -> Alignment:
    return Alignment(stamp_ns, motion, 0.0, float("nan"), False, refusal)


def _nearby(ground: F32, aerial_ground: F64, settings: Refinement) -> F32:
    """Ground points that some correspondence could use, wherever the search ends."""
    margin = settings.max_distance_m
    if settings.local_search:
        margin += settings.local_search_radius_m + 0.3
    low, high = aerial_ground.min(axis=0)[:2] - margin, aerial_ground.max(axis=0)[:2] + margin
    inside = ((ground[:, :2] >= low) & (ground[:, :2] <= high)).all(axis=1)
    result: F32 = ground[inside]
    return result


def _levelled(motion: SE3, points: F32) -> SE3:
    """The same place of the points' middle, with only the heading of the rotation."""
    centre = points.mean(axis=0, dtype=np.float64)
    turned = SE3.from_heading(motion.heading())
    return SE3(turned.rotation, motion @ centre - turned @ centre)


def _judged(
    stamp_ns: int, motion: SE3, source: Surfels, target: Surfels, settings: Refinement
) -> Alignment:
    """Inliers, their distances, and whether they suffice."""
    moved = motion @ source.points
    index, squared = target.nearest(moved)
    normals = target.normals[index]
    along = np.abs(((moved - target.points[index]) * normals).sum(axis=1))
    cover = make_height_map(target.points, COVER_CELLS_PER_M)
    covered = _covered(moved, cover)
    inlier = covered & (squared < settings.final_distance_m**2)
    share = float(inlier.sum() / max(covered.sum(), 1))
    rmse_m = float(np.sqrt((along[inlier] ** 2).mean())) if inlier.any() else float("nan")
    refusal = ""
    if covered.sum() < MIN_POINTS:
        refusal = "no overlap: the ground map has nothing below the aerial surface"
    elif share < settings.min_inliers:
        refusal = (
            f"clouds disagree: {share:.0%} of the aerial points over the ground map lie on it, of "
            f"{settings.min_inliers:.0%} needed"
        )
    else:
        agreed = agreement(make_height_map(moved, COVER_CELLS_PER_M), cover)
        if agreed.kappa < settings.min_agreement:
            refusal = (
                f"heights disagree: they agree over {agreed.share:.0%}, and over "
                f"{agreed.chance:.0%} when shifted, by too little structure or in the wrong place"
            )
    return Alignment(stamp_ns, motion, share, rmse_m, not refusal, refusal)


def _covered(points: F64, cover: HeightMap) -> Mask:
    """(N,) which points are over cells that the ground robot saw something of."""
    cells = np.floor(points[:, :2] * cover.cells_per_m + 0.5).astype(int) - lattice_index(cover)
    inside = ((cells >= 0) & (cells < cover.heights.shape)).all(axis=1)
    cells[~inside] = 0
    return inside & np.isfinite(cover.heights[cells[:, 0], cells[:, 1]])

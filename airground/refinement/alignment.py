"""From a rough relative pose to a precise one, or a refusal with its reason (Sec. VII)."""

from __future__ import annotations

from dataclasses import dataclass, replace

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
from airground.refinement.units import scale_by_extent, scale_by_spacing, scaled, without_strays

MIN_POINTS = 200
"""Least number of points of a cloud, and of the aerial points over the ground map."""
COVER_CELLS_PER_M = 25.0
"""Resolution at which the aligned maps are compared [cells/m]: twice a voxel of the ground map."""
TURNING_MARGIN_M = 0.6
"""What the searched headings move the edge of a surface of 4 m by [m]."""
MAX_MOVED_M, MAX_TURNED_DEG = 0.2, 4.0
"""How far a claim of localization may be corrected. Of 216 right corrections at level `hard` none
was beyond 0.1 m or 2.7 deg."""


def refine(
    stamp_ns: int,
    T_ground_mav_start: SE3,
    aerial: PointCloud,
    ground: PointCloud,
    config: Config,
    *,
    claimed: bool = False,
) -> Alignment:
    """Align an aerial cloud in the frame `mav` with the ground map in the frame `ground`.
    Clouds that are too small or do not overlap give a refusal with the start unchanged.

    `claimed` says that localization claims the start, by several surfaces: an alignment by this one
    that leads away from it is refused (`refinement.near_claim`)."""
    for name, cloud in (("aerial", aerial), ("ground", ground)):
        if len(cloud) < MIN_POINTS:
            refusal = f"no structure: the {name} cloud has {len(cloud)} points of {MIN_POINTS}"
            return _refused(stamp_ns, T_ground_mav_start, refusal)
    points = without_strays(aerial.points)
    overlaid = _overlay(points, ground.points, T_ground_mav_start, config.refinement)
    if overlaid is None:
        refusal = "no overlap: the ground map has nothing below the aerial surface"
        return _refused(stamp_ns, T_ground_mav_start, refusal)
    source, settings = overlaid.source, overlaid.settings

    # A better start than the guess, by the height maps nearby.
    start = T_ground_mav_start
    if settings.level_prior:
        start = _levelled(start, points)
    if settings.local_search:
        found = search_nearby(source.points, overlaid.nearby, start, settings)
        if found is None:
            return _refused(stamp_ns, start, "no overlap: height maps share too little nearby")
        start = found

    motion = point_to_plane_icp(source.points, overlaid.target, start, settings)
    judged = _judged(stamp_ns, motion, overlaid)
    if claimed and settings.near_claim and judged.accepted:
        refusal = _leads_away(T_ground_mav_start, motion, points, overlaid.scale)
        return replace(judged, accepted=not refusal, refusal=refusal)
    return judged


@dataclass(frozen=True, eq=False)
class _Overlay:
    """What one alignment works on, in its units.

    Attributes:
        source: The aerial surface, thinned.
        target: The ground map nearby, thinned.
        nearby: (N, 3) points of the ground map that some correspondence could use [m].
        settings: Parameters with their lengths multiplied by `scale`.
        scale: Factor of the lengths, at least 1.
    """

    source: Surfels
    target: Surfels
    nearby: F32
    settings: Refinement
    scale: float


def _overlay(points: F32, ground: F32, start: SE3, config: Refinement) -> _Overlay | None:
    """Both clouds in units of their extent and spacing; None where they do not overlap."""
    overlaid = _overlay_at(scale_by_extent(points, config), points, ground, start, config)
    if overlaid is None:
        return None
    scale = scale_by_spacing([overlaid.source, overlaid.target], config)
    if scale <= overlaid.scale:
        return overlaid
    return _overlay_at(scale, points, ground, start, config)


def _overlay_at(
    scale: float, points: F32, ground: F32, start: SE3, config: Refinement
) -> _Overlay | None:
    settings = scaled(config, scale)
    nearby = _nearby(ground, start @ points, settings, scale)
    if len(nearby) < MIN_POINTS:
        return None
    source, target = (make_surfels(cloud, settings.voxel_m) for cloud in (points, nearby))
    return _Overlay(source, target, nearby, settings, scale)


def _refused(stamp_ns: int, motion: SE3, refusal: str) -> Alignment:
    return Alignment(stamp_ns, motion, 0.0, float("nan"), False, refusal)


def _nearby(ground: F32, aerial_ground: F64, settings: Refinement, scale: float) -> F32:
    """Ground points that some correspondence could use, wherever the search ends."""
    margin = settings.max_distance_m
    if settings.local_search:
        margin += settings.local_search_radius_m + scale * TURNING_MARGIN_M
    low, high = aerial_ground.min(axis=0)[:2] - margin, aerial_ground.max(axis=0)[:2] + margin
    x, y = ground[:, 0], ground[:, 1]
    inside = (x >= low[0]) & (x <= high[0]) & (y >= low[1]) & (y <= high[1])
    result: F32 = ground[inside]
    return result


def _levelled(motion: SE3, points: F32) -> SE3:
    """The same place of the points' middle, with only the heading of the rotation."""
    centre = points.mean(axis=0, dtype=np.float64)
    turned = SE3.from_heading(motion.heading())
    return SE3(turned.rotation, motion @ centre - turned @ centre)


def _judged(stamp_ns: int, motion: SE3, overlaid: _Overlay) -> Alignment:
    """Inliers, their distances, and whether they suffice."""
    source, target, settings = overlaid.source, overlaid.target, overlaid.settings
    moved = motion @ source.points
    index, squared = target.nearest(moved)
    normals = target.normals[index]
    along = np.abs(((moved - target.points[index]) * normals).sum(axis=1))
    cells_per_m = COVER_CELLS_PER_M / overlaid.scale
    cover = make_height_map(target.points, cells_per_m)
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
        agreed = agreement(make_height_map(moved, cells_per_m), cover, overlaid.scale)
        if agreed.kappa < settings.min_agreement:
            refusal = (
                f"heights disagree: they agree over {agreed.share:.0%}, and over "
                f"{agreed.chance:.0%} when shifted, by too little structure or in the wrong place"
            )
    return Alignment(stamp_ns, motion, share, rmse_m, not refusal, refusal)


def _leads_away(claimed: SE3, motion: SE3, points: F32, scale: float) -> str:
    """Why a motion contradicts the claimed one; empty if it does not."""
    centre = points.mean(axis=0, dtype=np.float64)
    moved_m = float(np.linalg.norm((motion @ centre - claimed @ centre)[:2]))
    turned_deg = abs(np.rad2deg((motion @ claimed.inverse()).heading()))
    if moved_m <= MAX_MOVED_M * scale and turned_deg <= MAX_TURNED_DEG:
        return ""
    return f"leads away: {moved_m:.2f} m and {turned_deg:.1f} deg from the place that is claimed"


def _covered(points: F64, cover: HeightMap) -> Mask:
    """(N,) which points are over cells that the ground robot saw something of."""
    cells = np.floor(points[:, :2] * cover.cells_per_m + 0.5).astype(int) - lattice_index(cover)
    inside = ((cells >= 0) & (cells < cover.heights.shape)).all(axis=1)
    cells[~inside] = 0
    return inside & np.isfinite(cover.heights[cells[:, 0], cells[:, 1]])

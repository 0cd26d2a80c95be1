"""The first two views of a monocular map, also over a nearly planar scene (Sec. IV).

With the relative rotation from the gyro a plane is as good as any scene, since two rays give
the direction of translation. Without it a plane leaves up to two answers, and when the
images do not tell them apart none is given.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from airground.core.arrays import F64, Mask, freeze
from airground.core.camera import PinholeCamera
from airground.core.se3 import SE3, nearest_rotation, rotation_angle
from airground.slam.geometry.epipolar import direction_by_two_rays, refine
from airground.slam.geometry.triangulation import Triangulated, triangulate_pairs

SAMPLES = 200
MIN_PARALLAX_DEG = 1.5
"""Least median angle between rays: below it, noise and the gyro's error are as large [deg]."""
MIN_POINTS = 30
MIN_SHARE = 0.4
"""With fewer inliers than this share of the matches the views were not of one rigid scene."""
MAX_DIRECTION_SIGMA = np.deg2rad(6.0)
MAX_REPROJECTION_CHI2 = 9.21
"""99 % of the squared norms of two normal variables are below."""
MAX_SHIFT_RATIO = 5.0
"""A ray shifted more than this many times the median would be of a point that much nearer. A
wrong match that far along its epipolar line weighs more than all right ones."""
SAME_ANSWER = np.deg2rad(3.0)
CLEARLY_WORSE = 1.2
"""Another answer whose cost is not this many times the best one's may be the right one."""


@dataclass(frozen=True, eq=False)
class TwoViewStart:
    """Two views and the points they share, in units of the median depth.

    Attributes:
        T_a_b: Pose of view b in view a, scaled so that the inliers' median depth in a is 1;
            None where refused.
        points_a: (N, 3) points in view a; NaN where not an inlier.
        inliers: (N,) bool, whether a match agrees.
        parallax_rad: Median angle between the inliers' rays, rotation removed (of all matches
            where there is no inlier); NaN where no pose was found.
        good: Whether the start may be used.
        reason: Reason of the refusal; empty when good.
    """

    T_a_b: SE3 | None
    points_a: F64
    inliers: Mask
    parallax_rad: float
    good: bool
    reason: str

    def __post_init__(self) -> None:
        freeze(self, "points_a", (None, 3), np.float64)
        freeze(self, "inliers", (len(self.points_a),), np.bool_)


@dataclass(frozen=True, eq=False)
class _Answer:
    """One relative pose with |t| = 1 and what speaks for it."""

    T_a_b: SE3
    points: Triangulated
    inliers: Mask
    cost: float
    direction_sigma: float

    def same_as(self, other: _Answer) -> bool:
        turn = rotation_angle(self.T_a_b.rotation.T @ other.T_a_b.rotation)
        cosine = self.T_a_b.translation @ other.T_a_b.translation
        result: bool = turn < SAME_ANSWER and cosine > np.cos(2 * SAME_ANSWER)
        return result


def start_from_two_views(
    pixels_a: F64,
    pixels_b: F64,
    camera: PinholeCamera,
    rng: np.random.Generator,
    *,
    R_a_b: F64 | None = None,
    rotation_sigma: float = 0.005,
    sigma_px: float = 0.5,
) -> TwoViewStart:
    """Relative pose and points of two views, or the reason why they make no start.

    Args:
        pixels_a, pixels_b: (N, 2) matches, wrong ones among them.
        rng: Source of the samples where the rotation is known.
        R_a_b: (3, 3) relative rotation from the gyro; None if unknown.
        rotation_sigma: Standard deviation of that rotation per axis [rad].
        sigma_px: Standard deviation of a pixel per axis [px].
    """
    n = len(pixels_a)
    if n < MIN_POINTS:
        return _refused(n, np.nan, f"{n} matches, at least {MIN_POINTS} are needed")
    focal = np.sqrt(camera.fx * camera.fy)
    centre, scale = np.array([camera.cx, camera.cy]), np.array([camera.fx, camera.fy])
    rays_a = np.ascontiguousarray((pixels_a - centre) / scale)
    rays_b = np.ascontiguousarray((pixels_b - centre) / scale)
    sigma = sigma_px / focal
    if R_a_b is not None:
        wide = float(np.hypot(sigma, rotation_sigma))
        starts = _known_rotation(rays_a, rays_b, np.array(R_a_b, np.float64), wide, rng)
    else:
        wide, rotation_sigma = 3.0 * sigma, np.inf
        starts = _unknown_rotation(rays_a, rays_b, wide)
    answers = [_answer(R, t, rays_a, rays_b, (wide, sigma, rotation_sigma)) for R, t in starts]
    if not answers:
        return _refused(n, np.nan, "no relative pose explains the matches")
    best = min(answers, key=lambda answer: answer.cost)
    others = [a for a in answers if not a.same_as(best)]
    return _judged(best, others)


def _answer(
    R: F64, t: F64, rays_a: F64, rays_b: F64, sigmas: tuple[float, float, float]
) -> _Answer:
    """Refine one start, give the translation its sign, and triangulate."""
    wide, sigma, rotation_sigma = sigmas
    near = _shifted_alike(rays_a, rays_b, R)
    R, t, meet, covariance = refine(rays_a[near], rays_b[near], R, t, wide, sigma, rotation_sigma)
    unit = PinholeCamera(1, 1, 1.0, 1.0, 0.0, 0.0)
    R = nearest_rotation(R)
    both = []
    for T_a_b in (SE3(R, t), SE3(R, -t)):
        points = triangulate_pairs(SE3.identity(), rays_a, T_a_b, rays_b, unit)
        agrees = points.good & (points.reprojection_px**2 < MAX_REPROJECTION_CHI2 * sigma**2)
        agrees[near] &= meet
        agrees &= near
        both.append((int(agrees.sum()), T_a_b, points, agrees))
    _, T_a_b, points, inliers = max(both, key=lambda found: found[0])
    errors = np.where(inliers, (points.reprojection_px / sigma) ** 2, MAX_REPROJECTION_CHI2)
    direction_sigma = float(np.sqrt(np.trace(covariance[:2, :2])))
    return _Answer(T_a_b, points, inliers, float(errors.sum()), direction_sigma)


def _shifted_alike(rays_a: F64, rays_b: F64, R: F64) -> Mask:
    """(N,) whether a ray's shift, rotation removed, is not far above the median."""
    turned = np.column_stack([rays_b, np.ones(len(rays_b))]) @ R.T
    with np.errstate(divide="ignore", invalid="ignore"):
        shift = np.linalg.norm(turned[:, :2] / turned[:, 2:] - rays_a, axis=1)
    result: Mask = (turned[:, 2] > 0) & (shift <= MAX_SHIFT_RATIO * np.median(shift))
    return result


def _known_rotation(
    rays_a: F64, rays_b: F64, R: F64, sigma: float, rng: np.random.Generator
) -> list[tuple[F64, F64]]:
    """The direction that most rays allow; none where no sample gives one."""
    near = _shifted_alike(rays_a, rays_b, R)
    n = int(near.sum())
    if n < MIN_POINTS:
        return []
    first = rng.integers(0, n, SAMPLES)
    second = (first + rng.integers(1, n, SAMPLES)) % n
    t = direction_by_two_rays(rays_a[near], rays_b[near], R, first, second, sigma)
    return [(R, t)] if np.isfinite(t).all() else []


def _unknown_rotation(rays_a: F64, rays_b: F64, threshold: float) -> list[tuple[F64, F64]]:
    """Rotations and directions that an essential matrix or a homography allows."""
    # USAC starts its own generator anew in every call: the same input, the same answer.
    starts: list[tuple[NDArray[Any], NDArray[Any]]] = []
    E, _ = cv2.findEssentialMat(rays_b, rays_a, np.eye(3), cv2.USAC_ACCURATE, 0.9999, threshold)
    if E is not None and E.shape == (3, 3):
        R1, R2, t = cv2.decomposeEssentialMat(E)
        starts += [(R1, t.ravel()), (R2, t.ravel())]
    H, _ = cv2.findHomography(rays_b, rays_a, cv2.USAC_ACCURATE, threshold)
    if H is not None:
        _, rotations, translations, _ = cv2.decomposeHomographyMat(H, np.eye(3))
        starts += [(R, t.ravel()) for R, t in zip(rotations, translations, strict=True)]
    return [
        (nearest_rotation(R), np.ascontiguousarray(t, np.float64))
        for R, t in starts
        if np.linalg.norm(t) > 1e-9 and np.linalg.det(R) > 0
    ]


def _judged(best: _Answer, others: list[_Answer]) -> TwoViewStart:
    """Scale the best answer, or say why it is not good enough."""
    n, count = len(best.inliers), int(best.inliers.sum())
    chosen = best.inliers if count else np.ones(n, bool)
    parallax = float(np.median(best.points.parallax_rad[chosen]))
    degrees = np.rad2deg(parallax)
    if degrees < MIN_PARALLAX_DEG:
        reason = f"parallax of {degrees:.2f} deg, at least {MIN_PARALLAX_DEG} is needed"
    elif count < MIN_POINTS:
        reason = f"{count} matches agree, at least {MIN_POINTS} must"
    elif count < MIN_SHARE * n:
        reason = f"{count} of {n} matches agree, at least {100 * MIN_SHARE:.0f} % must"
    elif not best.direction_sigma < MAX_DIRECTION_SIGMA:
        reason = f"direction known to {np.rad2deg(best.direction_sigma):.0f} deg only"
    elif others and min(a.cost for a in others) < CLEARLY_WORSE * best.cost:
        reason = "two relative poses explain the matches equally well, as over a plane"
    else:
        scale = 1.0 / float(np.median(best.points.depth_a[best.inliers]))
        pose = SE3(best.T_a_b.rotation, scale * best.T_a_b.translation)
        points = np.where(best.inliers[:, None], scale * best.points.points, np.nan)
        return TwoViewStart(pose, points, best.inliers, parallax, True, "")
    return _refused(n, parallax, reason)


def _refused(n: int, parallax_rad: float, reason: str) -> TwoViewStart:
    nothing = np.full((n, 3), np.nan), np.zeros(n, bool)
    return TwoViewStart(None, *nothing, parallax_rad, False, reason)

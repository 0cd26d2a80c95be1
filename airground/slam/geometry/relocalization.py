"""Recognizing a place, from keyframes' map points alone: while lost, and to close loops."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import cv2
import numpy as np

from airground.core.arrays import F64, I64, U8, U64, Floats, freeze
from airground.core.camera import PinholeCamera
from airground.core.se3 import SE3, nearest_rotation
from airground.slam.corners import detect_corners
from airground.slam.geometry.descriptors import Described, describe, match, votes
from airground.slam.geometry.pose_estimation import PoseFit, estimate_pose

CORNERS = 800
CORNER_SPACING_PX = 12
VOTERS = 150
"""Corners that choose the keyframes to look at more closely."""
CANDIDATES = 5
MIN_ALIKE = 0.06
"""Another view of the same place has likenesses for a quarter of the corners, an edge of it for
this share; of other places few have as many."""
MIN_INLIERS = 20
MIN_INLIER_SHARE = 0.3
MIN_HULL_SHARE = 0.05
"""Inliers must span this share of the image: a small object may have moved, or have a twin."""
PNP_ROUNDS = 300
PNP_THRESHOLD_PX = 5.0
NO_POINTS = np.empty(0, np.int64)
SIGMA_PX = 1.5
"""A corner found anew lies this far from the one that was followed."""


@dataclass(frozen=True, eq=False)
class Matches:
    """Map points (n,) recognized in an image and their pixels (n, 2), good to 1 to 2 px."""

    point_ids: I64
    pixels: F64

    def __post_init__(self) -> None:
        freeze(self, "point_ids", (None,), np.int64)
        freeze(self, "pixels", (len(self.point_ids), 2), np.float64)


@dataclass(frozen=True, eq=False)
class Relocalization:
    """The pose of an image in the map by one keyframe; `fit.inliers` are over `matches`."""

    keyframe_id: int
    fit: PoseFit
    matches: Matches


class KeyframeIndex:
    """What map points look like in each keyframe: 32 bytes a point, no vocabulary."""

    def __init__(self) -> None:
        self._point_ids: dict[int, I64] = {}
        self._descriptors: dict[int, U64] = {}

    def __len__(self) -> int:
        return len(self._point_ids)

    def __contains__(self, keyframe_id: int) -> bool:
        return keyframe_id in self._point_ids

    def add(self, keyframe_id: int, image: U8, point_ids: I64, pixels: Floats) -> None:
        """Remember a keyframe by map points (n,) at pixels (n, 2); replaces its earlier entry."""
        self._point_ids[keyframe_id] = np.array(point_ids, np.int64)
        self._descriptors[keyframe_id] = describe(image, pixels).descriptors

    def remove(self, keyframe_id: int) -> None:
        del self._point_ids[keyframe_id], self._descriptors[keyframe_id]

    def held_points(self) -> I64:
        """(n,) numbers of the points remembered, in any order."""
        return np.concatenate([NO_POINTS, *self._point_ids.values()])

    def renumber(self, new: I64) -> None:
        """Points have other numbers: by the old one, `new` has that of each point."""
        self._point_ids = {keyframe: new[ids] for keyframe, ids in self._point_ids.items()}

    def alike(self, query: Described, among: list[int] | None = None) -> list[int]:
        """The keyframes most like an image, best first, among some or (None) all.
        The query's corners come strongest first."""
        ids = list(self._point_ids) if among is None else among
        if not ids:
            return []
        counts = self._votes(query.descriptors[:VOTERS], ids)
        return [ids[i] for i in np.argsort(-counts, kind="stable")[:CANDIDATES]]

    def resembling(self, keyframe_id: int, among: list[int]) -> list[int]:
        """Keyframes of `among` that may show the place of another one; far cheaper than `find`."""
        if not among:
            return []
        corners = self._descriptors[keyframe_id]
        counts = self._votes(corners, among)
        return [k for k, n in zip(among, counts, strict=True) if n >= MIN_ALIKE * len(corners) > 0]

    def _votes(self, descriptors: U64, among: list[int]) -> I64:
        """(g,) how many of the descriptors have a likeness in each of some keyframes."""
        groups = [self._descriptors[k] for k in among]
        starts = np.concatenate([[0], np.cumsum([len(group) for group in groups])])
        return votes(descriptors, np.concatenate(groups), starts)

    def match(self, query: Described, keyframe_id: int) -> Matches:
        """The keyframe's map points among an image's corners, some of them wrong."""
        rows, partners = match(query.descriptors, self._descriptors[keyframe_id])
        return Matches(self._point_ids[keyframe_id][partners], query.pixels[rows])

    def find(
        self,
        image: U8,
        camera: PinholeCamera,
        points: Callable[[I64], F64],
        among: list[int] | None = None,
    ) -> Relocalization | None:
        """The pose of an image; None where no keyframe determines it with certainty.

        Args:
            points: Function from point numbers (n,) to positions (n, 3), NaN if not mapped.
            among: Keyframes to look at; all by default.
        """
        query = describe_corners(image)
        found: list[Relocalization] = []
        for keyframe_id in self.alike(query, among):
            matches = self.match(query, keyframe_id)
            positions = points(matches.point_ids)
            mapped = np.isfinite(positions).all(axis=1)
            matches = Matches(matches.point_ids[mapped], matches.pixels[mapped])
            fit = pose_from_matches(positions[mapped], matches.pixels, camera)
            if fit is not None:
                found.append(Relocalization(keyframe_id, fit, matches))
        return max(found, key=lambda place: int(place.fit.inliers.sum()), default=None)


def describe_corners(image: U8) -> Described:
    """Corners of an image, strongest first, with their descriptors."""
    nothing = np.empty((0, 2), np.float32)
    return describe(image, detect_corners(image, nothing, CORNERS, CORNER_SPACING_PX))


def pose_from_matches(points_map: F64, pixels: F64, camera: PinholeCamera) -> PoseFit | None:
    """The pose that enough matches agree on, over enough of the image; None without one. Some of
    the n matches between `points_map` (n, 3) [m] and `pixels` (n, 2) may be wrong."""
    if len(points_map) < MIN_INLIERS:
        return None
    # OpenCV starts RANSAC's generator anew in every call: the same input, the same pose.
    found, turn, shift, rows = cv2.solvePnPRansac(
        points_map,
        pixels,
        camera.matrix(),
        None,
        iterationsCount=PNP_ROUNDS,
        reprojectionError=PNP_THRESHOLD_PX,
        confidence=0.999,
        flags=cv2.SOLVEPNP_AP3P,
    )
    if not found or rows is None or len(rows) < MIN_INLIERS:
        return None
    rotation = nearest_rotation(cv2.Rodrigues(turn)[0])
    start = SE3(rotation, np.asarray(shift, np.float64).ravel()).inverse()
    fit = estimate_pose(points_map, pixels, np.full(len(pixels), SIGMA_PX), camera, start)
    share = fit.inliers.mean()
    if fit.inliers.sum() < MIN_INLIERS or share < MIN_INLIER_SHARE:
        return None
    hull = cv2.convexHull(pixels[fit.inliers].astype(np.float32))
    if cv2.contourArea(hull) < MIN_HULL_SHARE * camera.width * camera.height:
        return None
    return fit

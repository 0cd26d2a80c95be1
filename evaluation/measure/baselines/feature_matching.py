"""Baselines by appearance: SIFT and ASIFT matches, and the camera pose by PnP.

Other features join by a `FeatureMatcher` of their own (`learned_matching`)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import cv2
import numpy as np
from numba import njit
from numpy.typing import NDArray

from airground.core.se3 import SE3, nearest_rotation
from evaluation.measure.baselines.interface import Answer, Given, View

REPROJECTION_PX = 4.0
ITERATIONS = 5_000
CONFIDENCE = 0.9999
SAME_PLACE_PX = 4.0
"""Matches whose ends lie in the same squares of this side count once."""
MIN_INLIERS = 12
"""Fewer matches that agree on a pose may agree by chance."""


@dataclass(frozen=True, eq=False)
class Features:
    """Features of one image.

    Attributes:
        pixels: (N, 2) pixels (x, y); corners may repeat with ASIFT.
        words: (N, D) float32 descriptors.
        size_px: Width and height of the image.
    """

    pixels: NDArray[np.float64]
    words: NDArray[np.float32]
    size_px: tuple[int, int]


class FeatureMatcher(Protocol):
    """Finds features in images, and those that look alike in two of them."""

    @property
    def turns(self) -> tuple[int, ...]:
        """Quarter turns of the aerial image that are tried; only 0 if no turn matters."""

    def features(self, grey: NDArray[np.uint8]) -> Features:
        """Features of a (height, width) image."""

    def pairs(self, aerial: Features, ground: Features) -> NDArray[np.int64]:
        """(K, 2) indices of the features that look alike."""


@dataclass(frozen=True, eq=False)
class Matches:
    """Features of one aerial and one ground view that look alike.

    Attributes:
        aerial_px, ground_px: (N, 2) pixels (x, y) in the two images.
        points_ground: (N, 3) their points by the ground robot's depth, in `ground` [m].
    """

    aerial_px: NDArray[np.float64]
    ground_px: NDArray[np.float64]
    points_ground: NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Located:
    """A camera pose, None if too few matches agree, and (N,) `inliers`: whether each match agrees,
    in the order of the views."""

    T_ground_camera: SE3 | None
    inliers: NDArray[np.bool_]


def located_by_appearance(given: Given, matcher: FeatureMatcher) -> Answer:
    """Match the MAV's image with each ground view, and estimate the pose from all matches."""
    if given.aerial_view is None or not given.ground_views:
        return Answer(None, "no image of the ground robot looks at what the MAV sees")
    matches = matches_of(given.aerial_view, given.ground_views, matcher)
    located = locate_camera(given.aerial_view, matches)
    count = int(located.inliers.sum())
    if located.T_ground_camera is None:
        found = sum(len(of_view.aerial_px) for of_view in matches)
        return Answer(None, f"{count} of {found} matches agree, {MIN_INLIERS} are needed")
    return Answer(located.T_ground_camera @ given.aerial_view.T_map_camera.inverse())


def matches_of(
    aerial: View, ground_views: tuple[View, ...], matcher: FeatureMatcher
) -> list[Matches]:
    """Matches that have depth, for each ground view; at the turn of the aerial image with most."""
    turned = [
        matcher.features(np.ascontiguousarray(np.rot90(aerial.grey, turn)))
        for turn in matcher.turns
    ]
    straight = [
        turned_back(of_aerial.pixels, turn, aerial.grey.shape)
        for of_aerial, turn in zip(turned, matcher.turns, strict=True)
    ]
    made = []
    for view in ground_views:
        of_ground = matcher.features(view.grey)
        ground_px = of_ground.pixels
        tried = [matcher.pairs(of_aerial, of_ground) for of_aerial in turned]
        best = max(range(len(tried)), key=lambda index: len(tried[index]))
        aerial_px, pairs = straight[best], tried[best]
        points, seen = _points_map(view, ground_px[pairs[:, 1]])
        pairs, points = pairs[seen], points[seen]
        kept = _distinct(aerial_px[pairs[:, 0]], ground_px[pairs[:, 1]])
        pairs, points = pairs[kept], points[kept]
        made.append(Matches(aerial_px[pairs[:, 0]], ground_px[pairs[:, 1]], points))
    return made


def turned_back(pixels: NDArray, turn: int, shape: tuple[int, ...]) -> NDArray[np.float64]:
    """(N, 2) pixels (x, y) of an image, whose `shape` is (height, width), from those of the same
    image after `turn` quarter turns by `np.rot90`."""
    x, y = np.asarray(pixels, np.float64).T
    for before in reversed(range(turn)):
        x, y = shape[(before + 1) % 2] - 1 - y, x
    return np.column_stack([x, y])


def locate_camera(aerial: View, matches: list[Matches]) -> Located:
    """The pose of the MAV's camera in `ground` by PnP with RANSAC over all matches."""
    pixels = np.concatenate([of_view.aerial_px for of_view in matches])
    points = np.concatenate([of_view.points_ground for of_view in matches])
    inliers = np.zeros(len(pixels), np.bool_)
    if len(pixels) < MIN_INLIERS:
        return Located(None, inliers)
    cv2.setRNGSeed(0)
    intrinsics = aerial.camera.matrix()
    found, turn, shift, kept = cv2.solvePnPRansac(
        points,
        pixels,
        intrinsics,
        None,
        iterationsCount=ITERATIONS,
        reprojectionError=REPROJECTION_PX,
        confidence=CONFIDENCE,
        flags=cv2.SOLVEPNP_AP3P,
    )
    if not found or kept is None:
        return Located(None, inliers)
    inliers[kept.ravel()] = True
    if inliers.sum() < MIN_INLIERS:
        return Located(None, inliers)
    turn, shift = cv2.solvePnPRefineLM(
        points[inliers], pixels[inliers], intrinsics, None, turn, shift
    )
    rotation = nearest_rotation(cv2.Rodrigues(turn)[0])
    if not (np.isfinite(rotation).all() and np.isfinite(shift).all()):
        return Located(None, inliers)
    return Located(SE3(rotation, np.asarray(shift, np.float64).ravel()).inverse(), inliers)


def _distinct(aerial_px: NDArray, ground_px: NDArray) -> NDArray[np.int64]:
    """Indices of the matches (N, 2) between other pixels than those before them.
    ASIFT's simulated views detect one corner many times, which would look like agreement."""
    places = np.floor(np.hstack([aerial_px, ground_px]) / SAME_PLACE_PX).astype(np.int64)
    _, first = np.unique(places, axis=0, return_index=True)
    return np.sort(first)


def _points_map(view: View, pixels: NDArray) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """(N, 3) points in the robot's map [m] at pixels (N, 2), and which have depth."""
    assert view.depth is not None
    x, y = np.rint(pixels).astype(np.int64).T
    inside = (x >= 0) & (x < view.camera.width) & (y >= 0) & (y < view.camera.height)
    depth = np.full(len(pixels), np.nan)
    depth[inside] = view.depth[y[inside], x[inside]]
    camera = view.camera
    rays = np.column_stack(
        [(pixels[:, 0] - camera.cx) / camera.fx, (pixels[:, 1] - camera.cy) / camera.fy,
         np.ones(len(pixels))]
    )  # fmt: skip
    return view.T_map_camera @ (rays * depth[:, None]), np.isfinite(depth)


RATIO = 0.8
"""Largest ratio of the distances of the best and second best match (Lowe, IJCV 2004, Sec. 7.1)."""
_ROWS, _COLUMNS = 256, 2048  # so many products stay in the cache


def clear_matches(aerial: NDArray[np.float32], ground: NDArray[np.float32]) -> NDArray[np.int64]:
    """(K, 2) indices of descriptors (N, D) and (M, D) whose best match is clearly the best."""
    if len(aerial) == 0 or len(ground) < 2:
        return np.empty((0, 2), np.int64)
    ground_squared = (ground**2).sum(axis=1)
    tiles = [slice(start, start + _COLUMNS) for start in range(0, len(ground), _COLUMNS)]
    transposed = [np.ascontiguousarray(ground[tile].T) for tile in tiles]
    two_least = np.full((len(aerial), 2), np.inf, np.float32)
    best = np.zeros(len(aerial), np.int64)
    for start in range(0, len(aerial), _ROWS):
        rows = slice(start, start + _ROWS)
        for tile, words in zip(tiles, transposed, strict=True):
            products = aerial[rows] @ words
            _keep_nearest(products, ground_squared[tile], tile.start, two_least[rows], best[rows])
    distances = np.maximum(two_least + (aerial**2).sum(axis=1)[:, None], 0)
    kept = np.flatnonzero(distances[:, 0] < RATIO**2 * distances[:, 1])
    return np.stack([kept, best[kept]], axis=1)


@njit(cache=True, nogil=True)
def _keep_nearest(products, ground_squared, start, two_least, best):  # type: ignore[no-untyped-def]
    """Add some columns: squared distances, without the term that a row's have in common."""
    two = np.float32(2)
    for row in range(len(products)):
        first, second = two_least[row]
        index = best[row]
        for column in range(len(ground_squared)):
            distance = ground_squared[column] - two * products[row, column]
            if distance < second:
                if distance < first:
                    first, second, index = distance, first, start + column
                else:
                    second = distance
        two_least[row, 0], two_least[row, 1], best[row] = first, second, index


@dataclass(frozen=True, eq=False)
class ClearMatcher:
    """Features of a detector of OpenCV, which no turn changes, matched by the ratio test."""

    detector: cv2.Feature2D
    turns: tuple[int, ...] = (0,)

    def features(self, grey: NDArray[np.uint8]) -> Features:
        """Features of a (height, width) image."""
        size_px = (grey.shape[1], grey.shape[0])
        keypoints, words = self.detector.detectAndCompute(grey, None)
        if words is None or len(keypoints) == 0:
            return Features(np.empty((0, 2)), np.empty((0, 128), np.float32), size_px)
        pixels = np.asarray(cv2.KeyPoint.convert(keypoints), np.float64)
        return Features(pixels, words.astype(np.float32), size_px)

    def pairs(self, aerial: Features, ground: Features) -> NDArray[np.int64]:
        """(K, 2) indices of the features whose best match is clearly the best."""
        return clear_matches(aerial.words, ground.words)


def asift_matcher() -> ClearMatcher:
    """SIFT under the tilts and rotations that ASIFT's authors recommend, by OpenCV."""
    return ClearMatcher(cv2.AffineFeature.create(cv2.SIFT.create()))


def sift_matcher() -> ClearMatcher:
    """SIFT by OpenCV."""
    return ClearMatcher(cv2.SIFT.create())


def asift(given: Given) -> Answer:
    """The MAV's camera by ASIFT features."""
    return located_by_appearance(given, asift_matcher())


def sift(given: Given) -> Answer:
    """The MAV's camera by SIFT features."""
    return located_by_appearance(given, sift_matcher())

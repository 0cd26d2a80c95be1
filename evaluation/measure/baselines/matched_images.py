"""One aerial and one ground image with what ASIFT matches between them (Fig. 3)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from airground.core.arrays import read_only
from airground.core.se3 import SE3
from airground.core.sighting import Sighting
from airground.io.recording import Recording
from evaluation.measure.baselines.feature_matching import asift_matcher, locate_camera, matches_of
from evaluation.measure.baselines.views import GroundViews, aerial_view


@dataclass(frozen=True, eq=False)
class MatchedImages:
    """The ground view with most matches that agree on a pose.

    Attributes:
        aerial, ground: (h, w) uint8 grey images.
        aerial_px, ground_px: (N, 2) pixels (x, y) of the matches that pass the ratio test
            and have depth.
        agrees: (N,) whether each agrees with one pose of the MAV's camera.
        views: Number of ground views that were matched.
        located: Whether enough matches agree, over all views, to claim that pose.
    """

    aerial: NDArray[np.uint8]
    ground: NDArray[np.uint8]
    aerial_px: NDArray[np.float64]
    ground_px: NDArray[np.float64]
    agrees: NDArray[np.bool_]
    views: int
    located: bool

    def __post_init__(self) -> None:
        for name, shape, dtype in (
            ("aerial", (None, None), np.uint8),
            ("ground", (None, None), np.uint8),
            ("aerial_px", (None, 2), np.float64),
            ("ground_px", (len(self.aerial_px), 2), np.float64),
            ("agrees", (len(self.aerial_px),), np.bool_),
        ):
            object.__setattr__(self, name, read_only(getattr(self, name), name, shape, dtype))


def match_images(
    recording: Recording, ground_poses: list[tuple[int, SE3]], sighting: Sighting, prior: SE3
) -> MatchedImages | None:
    """Match one sighting's image by ASIFT; None where no ground view looks at the surface.
    `prior` is an approximate T_ground_mav, which selects the ground views."""
    aerial = aerial_view(recording, sighting)
    views = GroundViews(recording, ground_poses).nearest(sighting, prior)
    if not views:
        return None
    matches = matches_of(aerial, views, asift_matcher())
    located = locate_camera(aerial, matches)
    ends = np.cumsum([len(of_view.aerial_px) for of_view in matches])
    agreeing = np.split(located.inliers, ends[:-1])
    best = max(range(len(views)), key=lambda i: (agreeing[i].sum(), len(agreeing[i])))
    return MatchedImages(
        aerial.grey,
        views[best].grey,
        matches[best].aerial_px,
        matches[best].ground_px,
        agreeing[best],
        len(views),
        located.T_ground_camera is not None,
    )

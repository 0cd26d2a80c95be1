"""The choice of keyframes, by what changed since the last one."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from airground.config import KeyframeSlam
from airground.core.arrays import F32, F64
from airground.core.camera import PinholeCamera
from airground.core.se3 import SE3
from airground.slam.feature_tracker import FeatureTracker
from airground.slam.rig_state import RigState
from airground.slam.sparse_map import Keyframe, SparseMap

SCARCE_POINTS, HASTE = 40, 0.4
"""With fewer map points than this in an image, a keyframe is made after this share of the usual
way: there is little left to track by, and new points need a second view."""


@dataclass(frozen=True)
class News:
    """What changed since the last keyframe.

    Attributes:
        share_left: Share of the keyframe's corners that are still followed.
        mapped_left: Number of map points followed now, relative to the keyframe's.
        parallax_px: Median motion of the corners, without that by turning [px]; 0 without corners.
    """

    share_left: float
    mapped_left: float
    parallax_px: float


@dataclass(eq=False)
class KeyframeChoice:
    """Chooses the images that stay."""

    map: SparseMap
    camera: PinholeCamera
    T_rig_camera: SE3
    parameters: KeyframeSlam

    def wanted(self, tracker: FeatureTracker, state: RigState, stamp_ns: int, timed: bool) -> bool:
        """Whether the newest image shows enough that the last keyframe did not; with `timed`, a
        keyframe is also due now and then if nothing is new."""
        last, parameters = self.map.keyframes[-1], self.parameters
        if timed and (stamp_ns - last.stamp_ns) * 1e-9 >= parameters.keyframe_interval_s:
            return True
        last_view = last.state.rotation @ self.T_rig_camera.rotation
        turn = last_view.T @ state.rotation @ self.T_rig_camera.rotation
        news = what_is_new(self.map, last, tracker, turn, self.camera)
        scarce = self.map.mapped(tracker.ids).sum() < SCARCE_POINTS
        parallax_px = (HASTE if scarce else 1.0) * parameters.keyframe_parallax_px
        return (
            news.share_left < parameters.keyframe_share
            or news.mapped_left < parameters.keyframe_share
            or news.parallax_px > parallax_px
        )


def what_is_new(
    sparse_map: SparseMap,
    last: Keyframe,
    tracker: FeatureTracker,
    R_last_here: F64,
    camera: PinholeCamera,
) -> News:
    """Compare the newest image with the last keyframe; the camera turned by (3, 3) meanwhile."""
    _, here, there = np.intersect1d(tracker.ids, last.ids, return_indices=True)
    moved = _turned(tracker.pixels[here], R_last_here, camera) - last.in_image()[there]
    parallax = np.linalg.norm(moved, axis=1)
    mapped_then = max(int(sparse_map.mapped(last.ids).sum()), 1)
    return News(
        len(here) / max(len(last.ids), 1),
        int(sparse_map.mapped(tracker.ids).sum()) / mapped_then,
        float(np.median(parallax)) if len(parallax) else 0.0,
    )


def _turned(pixels: F32, R: F64, camera: PinholeCamera) -> F64:
    """(N, 2) where pixels would be, had the camera not turned by R."""
    matrix = camera.matrix()
    rays = np.column_stack([pixels, np.ones(len(pixels))]) @ np.linalg.inv(matrix).T
    turned = rays @ R.T @ matrix.T
    result: F64 = turned[:, :2] / turned[:, 2:]
    return result

"""Expected pixels of followed corners in the next image."""

from __future__ import annotations

import numpy as np

from airground.core.arrays import F64
from airground.core.camera import PinholeCamera
from airground.core.se3 import SE3
from airground.slam.feature_tracker import FeatureTracker
from airground.slam.sparse_map import SparseMap


def expected_pixels(
    sparse_map: SparseMap, tracker: FeatureTracker, camera: PinholeCamera, here: SE3, there: SE3
) -> F64:
    """(N, 2) pixels of the tracker's corners in the next image.

    Map points go by their place, other corners as if they were as far as most map points.

    Args:
        sparse_map: Map with the positions of some corners.
        tracker: Corners in the newest image.
        camera: Camera of both images.
        here: `T_map_camera` of the newest image.
        there: `T_map_camera` of the next one, as predicted.
    """
    pixels = tracker.pixels.astype(np.float64)
    if len(pixels) == 0:
        return pixels
    z = (here.inverse() @ sparse_map.positions[tracker.ids])[:, 2]
    known = sparse_map.mapped(tracker.ids) & (z > 0)
    if known.any():
        z = np.where(known, z, np.median(z[known]))
    else:  # no depth to go by: only the turn counts
        z, there = np.ones(len(z)), SE3(there.rotation, here.translation)
    rays = np.column_stack([pixels, np.ones(len(z))]) @ np.linalg.inv(camera.matrix()).T
    expected = camera.project(there.inverse() @ (here @ (rays * z[:, None])))
    return np.where(np.isfinite(expected), expected, pixels)

"""The two height maps that localization overlays (Sec. VI-A, Fig. 7a and b)."""

from __future__ import annotations

import numpy as np

from airground.config import HeightMaps
from airground.core.arrays import F32, F64
from airground.core.belief import HeightMap
from airground.core.height_map import make_height_map


def aerial_height_map(
    points_mav: F32, position_mav: F64, heading: float, config: HeightMaps
) -> HeightMap:
    """Heights of an aerial surface around the camera that saw it.

    Args:
        points_mav: (N, 3) [m] in the frame `mav`.
        position_mav: (3,) the reference camera in `mav` [m].
        heading: Turn of the frame `mav` in `ground` [rad].
        config: Resolution and hole filling.

    Returns:
        x and y relative to the camera along the axes of `ground`: the map lies at a
        hypothesis u once u is added to its origin. Heights stay those of `mav`.
    """
    return make_height_map(
        around_camera(points_mav, position_mav, heading), config.cells_per_m, config.dilate_holes
    )


def around_camera(points_mav: F32, position_mav: F64, heading: float) -> F32:
    """(N, 3) points with x, y relative to the camera, turned by the heading; z unchanged."""
    c, s = np.cos(heading), np.sin(heading)
    offsets = np.asarray(points_mav, np.float64)[:, :2] - np.asarray(position_mav)[:2]
    points = np.empty((len(offsets), 3), np.float32)
    points[:, 0] = c * offsets[:, 0] - s * offsets[:, 1]
    points[:, 1] = s * offsets[:, 0] + c * offsets[:, 1]
    points[:, 2] = np.asarray(points_mav)[:, 2]
    return points


def ground_height_map(
    points_ground: F32, centre: F64, reach_m: float, config: HeightMaps
) -> HeightMap:
    """Heights of the ground robot's map over the square of half side `reach_m` at `centre`.

    Args:
        points_ground: (N, 3) [m] in the frame `ground`.
        centre: (2,) middle of the square [m].
        reach_m: Half its side [m].
        config: Resolution and hole filling.
    """
    window = (np.asarray(centre) - reach_m, np.asarray(centre) + reach_m)
    return make_height_map(points_ground, config.cells_per_m, config.dilate_holes, window)

"""Units of an alignment: the configured lengths, longer for wide maps and for sparse ones.

The number of cells and points then stays bounded, and so does the time. Correspondences bridge the
gaps between the points of a sparse map.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from airground.config import Refinement
from airground.core.arrays import F32
from airground.refinement.surfels import Surfels

CENTRAL = (0.01, 0.99)
"""Quantiles along x and y that bound the extent: a few stray points do not count."""
SAMPLES = 2000
"""Largest number of points at which the spacing is measured: its median is known to 3 %."""
LENGTHS = (
    "local_search_radius_m",
    "local_search_tolerance_m",
    "voxel_m",
    "max_distance_m",
    "final_distance_m",
)


def without_strays(points: F32) -> F32:
    """The points (N >= 1, 3) [m] at most one extent outside the box that bounds the extent."""
    low, high = np.quantile(points[:, :2], CENTRAL, axis=0)
    side = (high - low).max()
    (low_x, low_y), (high_x, high_y) = low - side, high + side
    x, y = points[:, 0], points[:, 1]
    inside = (x >= low_x) & (x <= high_x) & (y >= low_y) & (y <= high_y)
    result: F32 = points[inside]
    return result


def scale_by_extent(points: F32, config: Refinement) -> float:
    """Factor by which the extent of points (N >= 1, 3) [m] asks the lengths to grow."""
    low, high = np.quantile(points[:, :2], CENTRAL, axis=0)
    return float(max(1.0, (high - low).max() / config.extent_m))


def scale_by_spacing(clouds: Sequence[Surfels], config: Refinement) -> float:
    """Factor by which the sparser of some clouds asks the lengths to grow."""
    return max(1.0, *(_spacing(cloud) / config.spacing_m for cloud in clouds))


def scaled(config: Refinement, scale: float) -> Refinement:
    """The same parameters with every length multiplied."""
    longer = {name: scale * getattr(config, name) for name in LENGTHS}
    coarser = config.local_search_cells_per_m / scale
    return config.model_copy(update={**longer, "local_search_cells_per_m": coarser})


def _spacing(cloud: Surfels) -> float:
    """Median distance of a point from its nearest neighbour [m]; 0 for one point."""
    some = cloud.points[:: max(1, len(cloud) // SAMPLES)]
    _, squared = cloud.tree.batch_knn_search(some, 2, num_threads=1)
    return float(np.sqrt(np.median(np.asarray(squared)[:, 1]))) if len(cloud) > 1 else 0.0

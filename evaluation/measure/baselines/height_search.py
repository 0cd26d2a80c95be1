"""Baselines on height maps: ZMSSD, normalized cross correlation, phase correlation."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from airground.core.height_map import lattice_index
from airground.localization.height_map_pair import HeightMapPair
from airground.localization.particle_filter import motion_at
from airground.pipeline import pair_of
from evaluation.measure.baselines.interface import Answer, Given
from evaluation.setup.setups import with_localization

MIN_OVERLAP = 0.5
"""Share of the aerial map's area that the maps must overlap by, as in the paper (Sec. VI-A)."""


def height_maps(given: Given, **localization: object) -> HeightMapPair:
    """The maps that ours would make, with the paper's least overlap. The heading is searched where
    ours does, and where the magnetometers give none."""
    settings = {"min_overlap": MIN_OVERLAP, **localization}
    if given.sighting.heading is None:
        settings["heading"] = "search"
    return pair_of(given.sighting, with_localization(given.config, **settings))


def answer_at(given: Given, maps: HeightMapPair, estimate: NDArray) -> Answer:
    """The answer that puts the MAV's camera at (x, y) in `ground` [m] with a heading [rad].
    The height follows from the mean difference over the overlap (Delta z of Sec. VI-A)."""
    offset = float(maps.overlay(estimate[None]).height_offsets()[0])
    camera_mav = given.sighting.surface.T_mav_camera.translation
    return Answer(motion_at(estimate, camera_mav, offset))


def lowest_cost(given: Given, cost: str, min_relief_m: float) -> Answer:
    """The position of lowest cost ("zmssd" or "ncc") in the search region (Eq. 3), always claimed.
    `min_relief_m` is the least standard deviation of both maps' heights in the correlation."""
    maps = height_maps(given, cost=cost, min_relief_m=min_relief_m)
    cost_map = maps.volume.cost_map(cost)
    best = cost_map.best()
    if best is None:
        return Answer(None, f"nowhere do the maps overlap by {MIN_OVERLAP:.0%}")
    return answer_at(given, maps, np.array([*best, cost_map.heading]))


RELIEF_FLOOR_M = 0.001
"""Below this, sums in single precision are rounding errors. Ours demands relief above the maps'
noise (`min_relief_m`); plain correlation does not."""


def ncc_search(given: Given) -> Answer:
    """Place the aerial height map where heights correlate best."""
    return lowest_cost(given, "ncc", RELIEF_FLOOR_M)


def zmssd_search(given: Given) -> Answer:
    """Place the aerial height map where heights differ least about their mean difference."""
    return lowest_cost(given, "zmssd", given.config.localization.min_relief_m)


def phase_correlation(given: Given) -> Answer:
    """Register the height maps as images with holes, by scikit-image.
    It compares translations alone, so the heading is always that of the magnetometers. Its overlap
    rule is a share of the largest overlap of any offset. An offset outside of the search region is
    not claimed; any other is."""
    from skimage.registration import phase_cross_correlation

    if given.sighting.heading is None:
        return Answer(None, "the heading is unknown")
    maps = height_maps(given, heading="known")
    ground, ground_mask = _image(maps.ground.heights)
    aerial, aerial_mask = _image(_padded(maps.aerial.heights, ground.shape))
    if not (ground_mask.any() and aerial_mask.any()):
        return Answer(None, "a height map is empty")
    shift, _, _ = phase_cross_correlation(
        ground,
        aerial,
        reference_mask=ground_mask,
        moving_mask=aerial_mask,
        overlap_ratio=MIN_OVERLAP,
    )
    # The shift is between arrays; their places on the lattice make it one of the camera.
    offset = np.rint(shift) + lattice_index(maps.ground) - lattice_index(maps.aerial)
    position = offset / maps.ground.cells_per_m
    found = answer_at(given, maps, np.array([*position, maps.turn]))
    radius_m = given.config.localization.search_radius_m
    if (np.abs(position - maps.ground_robot_position) > radius_m).any():
        return Answer(found.T_ground_mav, "the best offset lies outside of the search region")
    return found


def _padded(heights: NDArray[np.float32], shape: tuple[int, ...]) -> NDArray[np.float32]:
    """The map with holes added up to a shape: images of one size have one centre."""
    added = [(0, max(0, full - size)) for size, full in zip(heights.shape, shape, strict=True)]
    return np.pad(heights, added, constant_values=np.nan)


def _image(heights: NDArray[np.float32]) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Heights about their mean with 0 in holes, and which pixels are no holes."""
    mask = np.isfinite(heights)
    mean = heights[mask].mean(dtype=np.float64) if mask.any() else 0.0
    return np.where(mask, heights - mean, 0.0), mask

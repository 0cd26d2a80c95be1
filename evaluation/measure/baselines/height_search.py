"""Baselines on height maps: ZMSSD, normalized cross correlation, phase correlation."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from airground.core.belief import HeightMap
from airground.core.height_map import lattice_index
from airground.localization.cost_map import compute_cost_map, overlay_at, reach_of
from airground.localization.height_map import aerial_height_map, ground_height_map
from airground.localization.particle_filter import motion_at
from evaluation.measure.baselines.interface import Answer, Given
from evaluation.setup.setups import with_localization

MIN_OVERLAP = 0.5
"""Of the aerial map's area, as the paper asks (Sec. VI-A)."""


@dataclass(frozen=True, eq=False)
class HeightMaps:
    """Both height maps on one lattice, turned alike by the magnetometers.

    Attributes:
        aerial: Around the MAV's camera.
        ground: In `ground`, as far as the search region and the aerial map reach.
        heading: Turn of `mav` in `ground` [rad].
        centre: (2,) middle of the search region [m].
        radius_m: Half its side [m].
    """

    aerial: HeightMap
    ground: HeightMap
    heading: float
    centre: NDArray[np.float64]
    radius_m: float


def height_maps(given: Given) -> HeightMaps | None:
    """The maps that ours would make; None while the heading is unknown."""
    sighting, settings = given.sighting, given.config.height_maps
    if sighting.heading is None:
        return None
    surface = sighting.surface
    position = surface.T_mav_camera.translation
    aerial = aerial_height_map(surface.cloud_mav.points, position, sighting.heading, settings)
    centre = sighting.T_ground_camera.translation[:2]
    radius_m = given.config.localization.search_radius_m
    reach_m = float(np.linalg.norm(reach_of(aerial), axis=1).max() + 2) / aerial.cells_per_m
    ground = ground_height_map(sighting.ground_cloud.points, centre, radius_m + reach_m, settings)
    return HeightMaps(aerial, ground, sighting.heading, centre, radius_m)


def answer_at(given: Given, maps: HeightMaps, position: NDArray) -> Answer:
    """The answer that puts the MAV's camera at (x, y) in `ground` [m].

    The height follows from the mean difference over the overlap (Delta z of Sec. VI-A).
    """
    offset = float(overlay_at(maps.aerial, maps.ground, position[None]).height_offsets()[0])
    estimate = np.array([*position, maps.heading])
    camera_mav = given.sighting.surface.T_mav_camera.translation
    return Answer(motion_at(estimate, camera_mav, offset))


def lowest_cost(given: Given, cost: str, min_relief_m: float) -> Answer:
    """The position of lowest cost in the search region (Eq. 3), always claimed.

    Args:
        given: Its height maps are used.
        cost: "zmssd" or "ncc".
        min_relief_m: Floor of both maps' standard deviations in the correlation [m].
    """
    maps = height_maps(given)
    if maps is None:
        return Answer(None, "the heading is unknown")
    config = with_localization(
        given.config, cost=cost, min_overlap=MIN_OVERLAP, min_relief_m=min_relief_m
    ).localization
    best = compute_cost_map(maps.aerial, maps.ground, maps.centre, maps.heading, config).best()
    if best is None:
        return Answer(None, f"nowhere do the maps overlap by {MIN_OVERLAP:.0%}")
    return answer_at(given, maps, best)


RELIEF_FLOOR_M = 0.001
"""Ours holds relief above the maps' noise (`min_relief_m`); plain correlation has no such
floor, but sums in single precision mean nothing below this."""


def ncc_search(given: Given) -> Answer:
    """Lay the aerial height map where heights correlate best."""
    return lowest_cost(given, "ncc", RELIEF_FLOOR_M)


def zmssd_search(given: Given) -> Answer:
    """Lay the aerial height map where heights differ least about their mean difference."""
    return lowest_cost(given, "zmssd", given.config.localization.min_relief_m)


def phase_correlation(given: Given) -> Answer:
    """Register the height maps as images with holes, by scikit-image.

    Its overlap rule is a share of the largest overlap of any offset. An offset outside of
    the search region is refused; any other is claimed.
    """
    from skimage.registration import phase_cross_correlation

    maps = height_maps(given)
    if maps is None:
        return Answer(None, "the heading is unknown")
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
    # The shift moves arrays; the maps' places on the lattice make it one of the camera.
    offset = np.rint(shift) + lattice_index(maps.ground) - lattice_index(maps.aerial)
    position = offset / maps.ground.cells_per_m
    found = answer_at(given, maps, position)
    if (np.abs(position - maps.centre) > maps.radius_m).any():
        return Answer(found.T_ground_mav, "the best offset lies outside of the search region")
    return found


def _padded(heights: NDArray[np.float32], shape: tuple[int, ...]) -> NDArray[np.float32]:
    """The map with holes added up to a shape: images of one size have one centre."""
    after = [(0, max(0, wanted - size)) for size, wanted in zip(heights.shape, shape, strict=True)]
    return np.pad(heights, after, constant_values=np.nan)


def _image(heights: NDArray[np.float32]) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Heights about their mean with 0 in holes, and which pixels are none."""
    mask = np.isfinite(heights)
    mean = heights[mask].mean(dtype=np.float64) if mask.any() else 0.0
    return np.where(mask, heights - mean, 0.0), mask

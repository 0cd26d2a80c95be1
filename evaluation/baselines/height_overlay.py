"""What baselines on height maps share: the two maps, and the motion that an offset means."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from airground.core.belief import HeightMap
from airground.localization.cost_map import compute_cost_map, overlay_at, reach_of
from airground.localization.height_map import aerial_height_map, ground_height_map
from airground.localization.particle_filter import motion_at
from evaluation.baselines.seam import Answer, Given
from evaluation.protocol.setups import with_localization

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

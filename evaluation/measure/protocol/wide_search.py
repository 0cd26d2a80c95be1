"""Wide search: localization of single aerial maps in a region well beyond the ground map.

Most places in the region overlap little with the aerial map, or not at all, and few cells are
easily similar by chance.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from airground.config import Config
from airground.core.belief import CostMap
from airground.core.events import CostMapComputed
from airground.core.sighting import Sighting
from evaluation.measure.protocol.trials import localize_sequence, spread_evenly
from evaluation.setup.setups import with_localization
from evaluation.table.row_writer import RowWriter
from evaluation.table.truth_errors import true_T_ground_mav
from sim.recording.truth import Truth

STAGE = "wide_search"
"""Stage of the rows; metrics are `error_m`, `converged` and `lead`, trial the map's index."""
WIDER = 2.0
"""Search radius as a multiple of the pipeline's: enough to reach beyond the ground map."""
HERE_M, ELSEWHERE_M = 0.25, 0.5
"""Radius within which a place counts as the true one, and beyond which as another [m]."""
WORST = {"zmssd": 2.0, "ncc": 2.0, "likelihood": 0.0, "channels": 0.0}
"""Cost of heights that differ by 2 m RMS [m^2], with correlation -1, and that fit by chance."""


def add_wide_searches(
    out: RowWriter,
    sightings: Sequence[Sighting],
    truth: Truth,
    config: Config,
    seed: tuple[int, int],
    count: int,
) -> None:
    """Localize single aerial maps, each with a new filter, and write the results.
    `seed` has the seed of the recording and the number of the flight; `count` aerial maps are
    spread evenly over the flight."""
    radius_m = WIDER * config.localization.search_radius_m
    widened = with_localization(config, search_radius_m=radius_m)
    for trial in spread_evenly(len(sightings), count):
        sighting, rng = sightings[trial], np.random.default_rng([*seed, 8, trial])
        camera = true_T_ground_mav(sighting, truth) @ sighting.surface.T_mav_camera
        for event, _, found in localize_sequence([sighting], truth, widened, rng):
            if isinstance(event, CostMapComputed):
                lead = lead_of(event.cost_map, camera.translation[:2])
                out.add(STAGE, "lead", lead, "", trial=trial)
            if found is not None:
                out.add(STAGE, "error_m", found.error.horizontal_m, "m", trial=trial)
                note = found.belief.refusal
                out.add(STAGE, "converged", found.belief.converged, "", trial=trial, note=note)


def lead_of(cost_map: CostMap, place: NDArray) -> float:
    """Lowest cost elsewhere minus the lowest at the true place (2,) [m], in units of the cost.
    Positive if the true place has the lowest cost. A place without a cost counts as `WORST`."""
    cells = np.indices(cost_map.costs.shape) / cost_map.cells_per_m
    away = np.hypot(*(cells + (cost_map.origin - place)[:, None, None]))
    worst = WORST[cost_map.cost]
    costs = np.nan_to_num(cost_map.costs, nan=worst)
    here = costs[away <= HERE_M].min(initial=worst)
    elsewhere = costs[away > ELSEWHERE_M].min(initial=worst)
    return float(elsewhere - here)

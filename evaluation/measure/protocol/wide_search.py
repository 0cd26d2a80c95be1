"""Finding aerial maps one by one where the robots hardly know how far apart they are.

The search region reaches well beyond the ground map here. Most of the places in it hold little
of the aerial map, or nothing, and a few cells resemble each other easily.
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
"""Metrics are `error_m`, `converged` and `lead`, by the aerial map's number as the trial."""
WIDER = 2.0
"""So many times as far around the ground robot as the pipeline would search."""
HERE_M, ELSEWHERE_M = 0.25, 0.5
"""Places this close to the true one are the same place, and beyond this another."""
WORST = 2.0
"""Cost of heights that correlate by -1; as ZMSSD [m^2], of heights that differ by 2 m RMS."""


def add_wide_searches(
    out: RowWriter,
    sightings: Sequence[Sighting],
    truth: Truth,
    config: Config,
    seed: tuple[int, int],
    count: int,
) -> None:
    """Write where each of some aerial maps is found, every one by a new filter.

    Args:
        out: Takes the rows.
        sightings: Of one flight.
        truth: Judges.
        config: Of the pipeline.
        seed: Of the recording and the flight.
        count: Maps to try, spread evenly over the flight.
    """
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
    """The lowest cost elsewhere minus that at the true place, in units of the cost.

    Positive where the true place wins. Where no place has a cost, `WORST` stands for it.

    Args:
        cost_map: Of one aerial map.
        place: (2,) the true u [m].
    """
    cells = np.indices(cost_map.costs.shape) / cost_map.cells_per_m
    away = np.hypot(*(cells + (cost_map.origin - place)[:, None, None]))
    costs = np.nan_to_num(cost_map.costs, nan=WORST)
    here = costs[away <= HERE_M].min(initial=WORST)
    elsewhere = costs[away > ELSEWHERE_M].min(initial=WORST)
    return float(elsewhere - here)

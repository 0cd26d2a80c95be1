"""Negative cases: aerial maps without a place in the ground map, made from a mapped flight."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from airground.config import Config
from airground.core.belief import Alignment
from airground.core.cloud import PointCloud
from airground.core.sighting import Sighting
from airground.localization.particle_filter import MonteCarloLocalizer
from airground.pipeline import locate
from evaluation.measure.protocol.mapping_pass import GroundPass, Maps
from evaluation.measure.protocol.trials import (
    Iteration,
    Protocol,
    localize_sequences,
    refined,
    sequence_starts,
    trial_sightings,
)
from evaluation.table.row_writer import RowWriter
from evaluation.table.truth_errors import PoseError, pose_error, true_T_ground_mav
from sim.recording.truth import Truth

OVERLAP_LEFT = 0.10
"""Share of the aerial points above the ground map in `NO_OVERLAP`: less than the least overlap
that localization requires."""


def add_negatives(
    out: RowWriter,
    maps: Maps,
    stranger: GroundPass | None,
    truth: Truth,
    config: Config,
    seed: tuple[int, int],
    protocol: Protocol,
) -> None:
    """Write the results of localization and refinement in the negative cases.

    The sightings are those of the positive sequences and trials, of `maps`. `stranger` is a ground
    robot's map of another scene; None leaves `WRONG_MAP` out. `seed` has the seed of the recording
    and the number of the flight.
    """
    together = config.localization.maps_together
    sightings = [
        without_overlap(maps.sightings[max(0, newest - together + 1) : newest + 1], truth)
        for newest in range(len(maps.sightings))
    ]
    _add_case(out, NO_OVERLAP, sightings, truth, config, seed, protocol)
    if stranger is not None:
        sightings = [over_another_map(sighting, stranger) for sighting in maps.sightings]
        _add_case(out, WRONG_MAP, sightings, truth, config, seed, protocol)


def without_overlap(together: Sequence[Sighting], truth: Truth) -> Sighting:
    """The newest sighting, its ground map under only `OVERLAP_LEFT` of its aerial surface, and of
    that with those before it which are localized together with it.
    The ground map is cut along a line across the aerial surface, and the side of the ground map's
    centre is kept, as if the robot had not driven that far yet."""
    sighting = together[-1]
    T_ground_mav = true_T_ground_mav(sighting, truth)
    surfaces = [_horizontal(T_ground_mav @ one.surface.cloud_mav.points) for one in together]
    cloud = sighting.ground_cloud
    ground = _horizontal(cloud.points)
    if len(surfaces[-1]) == 0 or len(ground) == 0:
        return sighting
    away = ground.mean(axis=0) - surfaces[-1].mean(axis=0)
    joined = [np.concatenate(surfaces[first:]) for first in range(len(surfaces))]
    edge = max(np.quantile(aerial @ away, 1 - OVERLAP_LEFT) for aerial in joined)
    kept = ground @ away > edge
    return replace(sighting, ground_cloud=PointCloud(cloud.points[kept], cloud.colours[kept]))


def over_another_map(sighting: Sighting, stranger: GroundPass) -> Sighting:
    """A sighting over another robot's ground map; its heading is kept."""
    return replace(
        sighting, ground_cloud=stranger.cloud_ground, T_ground_camera=stranger.T_ground_camera
    )


def _add_case(
    out: RowWriter,
    case: Case,
    sightings: Sequence[Sighting],
    truth: Truth,
    config: Config,
    seed: tuple[int, int],
    protocol: Protocol,
) -> None:
    length, iterations = protocol.sequence_length, Counter[int]()
    starts = sequence_starts(len(sightings), protocol.sequences, length)
    filters = {
        sequence: (start, np.random.default_rng([*seed, 6, case.number, sequence]))
        for sequence, start in enumerate(starts)
    }
    for sequence, _, _, step in localize_sequences(sightings, length, truth, config, filters):
        if step is not None:
            iterations[sequence] += 1
            _add_belief(out, case, step, sequence, iterations[sequence])
    for trial, index in enumerate(trial_sightings(len(sightings), protocol.trials)):
        rng = np.random.default_rng([*seed, 7, case.number, trial])
        alignment = refine_best_guess(sightings[index], config, rng)
        error = pose_error(alignment.T_ground_mav, sightings[index], truth)
        _add_alignment(out, case, alignment, error, trial)


def refine_best_guess(sighting: Sighting, config: Config, rng: np.random.Generator) -> Alignment:
    """Refine from the belief of localization, whether it claims a position or not.
    No start makes a wrong alignment more likely than the place most similar to the aerial map."""
    localizer = MonteCarloLocalizer(config, rng)
    for _ in locate(localizer, sighting):
        pass
    assert localizer.belief is not None
    return refined(sighting, localizer.belief.T_ground_mav, config)


def _add_belief(out: RowWriter, case: Case, step: Iteration, sequence: int, iteration: int) -> None:
    belief, off_m = step.belief, step.error.horizontal_m
    out.add(
        case.stage,
        "converged",
        belief.converged,
        "",
        sequence=sequence,
        iteration=iteration,
        note=belief.refusal,
    )
    if case.has_truth:
        out.add(case.stage, "error_m", off_m, "m", sequence=sequence, iteration=iteration)


def _add_alignment(
    out: RowWriter, case: Case, alignment: Alignment, error: PoseError, trial: int
) -> None:
    out.add(case.stage, "accepted", alignment.accepted, "", trial=trial, note=alignment.refusal)
    if case.has_truth:
        out.add(case.stage, "after_translation_m", error.translation_m, "m", trial=trial)
        out.add(case.stage, "after_rotation_deg", error.rotation_deg, "deg", trial=trial)


def _horizontal(points: NDArray) -> NDArray[np.float64]:
    """(N, 2) x and y of points (N, 3)."""
    return np.asarray(points[:, :2], np.float64)


@dataclass(frozen=True)
class Case:
    """One negative case.

    Attributes:
        stage: Stage of its rows. Metrics are `converged` and `error_m` of localizations, by
            sequence and iteration; `accepted`, `after_translation_m` and `after_rotation_deg` of
            refinements, by trial. Without a truth there are no errors.
        number: Part of the seed of its random numbers.
        has_truth: Whether the MAV has a true pose in the frame of the ground map.
    """

    stage: str
    number: int
    has_truth: bool


NO_OVERLAP = Case("no_overlap", 0, has_truth=True)
WRONG_MAP = Case("wrong_map", 1, has_truth=False)
CASES = (NO_OVERLAP, WRONG_MAP)

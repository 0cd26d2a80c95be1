"""Negative cases: aerial maps with no place to find, made of a flight that was mapped already."""

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
from airground.refinement import refine
from evaluation.measure.protocol.mapping_pass import GroundPass, Maps
from evaluation.measure.protocol.trials import (
    Iteration,
    Protocol,
    localize_sequences,
    sequence_starts,
    trial_sightings,
)
from evaluation.table.row_writer import RowWriter
from evaluation.table.truth_errors import PoseError, pose_error, true_T_ground_mav
from sim.recording.truth import Truth

OVERLAP_LEFT = 0.10
"""Share of the aerial points that the ground map still reaches under in `NO_OVERLAP`: a third
of the least overlap that localization asks for."""


def add_negatives(
    out: RowWriter,
    maps: Maps,
    stranger: GroundPass | None,
    truth: Truth,
    config: Config,
    seed: tuple[int, int],
    protocol: Protocol,
) -> None:
    """Write what localization and refinement say where there is nothing to find.

    Args:
        out: Takes rows of the cases' stages.
        maps: What was mapped; the sightings of the positive sequences and trials are used.
        stranger: A ground robot's map of another scene; None leaves `WRONG_MAP` out.
        truth: Cuts the overlap away, and judges where there is something to judge.
        config: Of localization and refinement.
        seed: Of the recording and the flight.
        protocol: How much is tried in each case.
    """
    lost = [without_overlap(sighting, truth) for sighting in maps.sightings]
    _add_case(out, NO_OVERLAP, lost, truth, config, seed, protocol)
    if stranger is not None:
        lost = [over_another_map(sighting, stranger) for sighting in maps.sightings]
        _add_case(out, WRONG_MAP, lost, truth, config, seed, protocol)


def without_overlap(sighting: Sighting, truth: Truth) -> Sighting:
    """The ground map ends before the aerial surface begins, but for `OVERLAP_LEFT` of it.

    It is cut along a line across the aerial surface, and what lies on the side of its own
    middle is kept: as if the robot had not driven that far yet.
    """
    aerial = _horizontal(true_T_ground_mav(sighting, truth) @ sighting.surface.cloud_mav.points)
    cloud = sighting.ground_cloud
    ground = _horizontal(cloud.points)
    if len(aerial) == 0 or len(ground) == 0:
        return sighting
    away = ground.mean(axis=0) - aerial.mean(axis=0)
    edge = np.quantile(aerial @ away, 1 - OVERLAP_LEFT)
    kept = ground @ away > edge
    return replace(sighting, ground_cloud=PointCloud(cloud.points[kept], cloud.colours[kept]))


def over_another_map(sighting: Sighting, stranger: GroundPass) -> Sighting:
    """The ground robot is another one, somewhere else; headings are as good as any there."""
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
    """Refine where localization would look first, whether it claims that place or not.

    No start is worse than the place that resembles the aerial map most.
    """
    localizer = MonteCarloLocalizer(config, rng)
    for _ in locate(localizer, sighting):
        pass
    assert localizer.belief is not None
    surface, start = sighting.surface, localizer.belief.T_ground_mav
    return refine(surface.stamp_ns, start, surface.cloud_mav, sighting.ground_cloud, config)


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
    """One kind of negative.

    Attributes:
        stage: Of its rows. Metrics are `converged` and `error_m` of localizations, by sequence
            and iteration; `accepted`, `after_translation_m` and `after_rotation_deg` of
            refinements, by trial. Without a truth there are no errors.
        number: Seeds its draws.
        has_truth: Whether the MAV is somewhere in the frame of the ground map, though off it.
    """

    stage: str
    number: int
    has_truth: bool


NO_OVERLAP = Case("no_overlap", 0, has_truth=True)
WRONG_MAP = Case("wrong_map", 1, has_truth=False)
CASES = (NO_OVERLAP, WRONG_MAP)

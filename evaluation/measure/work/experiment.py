"""Everything measured on one recording: surfaces, sequences, refinement trials, extras.

One pass of the pipeline makes the sightings. Sequence 0 and the alignments are the pipeline's
own. The other sequences and the refinement trials repeat its sightings: from a later start of
the particle filter, or from a noisy start of refinement; their rows say so.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from airground.io.recording import Recording
from evaluation.measure.baselines.appearance import add_appearance
from evaluation.measure.baselines.measure import add_baselines
from evaluation.measure.close_up import CloseUp
from evaluation.measure.protocol.error_budget import add_error_budget
from evaluation.measure.protocol.mapping_pass import (
    GroundPass,
    Localized,
    Maps,
    localize_again,
    map_ground,
    map_recording,
)
from evaluation.measure.protocol.negatives import add_negatives
from evaluation.measure.protocol.trials import (
    Iteration,
    localize_sequences,
    refine_sighting,
    sequence_starts,
    trial_sightings,
)
from evaluation.measure.protocol.wide_search import add_wide_searches
from evaluation.measure.showcase import Showcase
from evaluation.measure.work.unit import Finished, Unit
from evaluation.run.onlooker import STAGE_OF
from evaluation.run.tracking import localizer_rng
from evaluation.setup.memory import peak_memory_mib
from evaluation.table.reference import reference_of
from evaluation.table.row_writer import RowWriter
from evaluation.table.rows import ALIGNMENT_STAGE, ResultTable
from evaluation.table.tracking_quality import add_tracking
from evaluation.table.truth_errors import pose_error, surface_error
from sim.recording.recorder import Flight, rendered
from sim.recording.truth import Truth

REPEATED = "the pipeline's sightings, repeated from a later start"


def measure_units(units: Sequence[Unit], renderers: int) -> list[Finished]:
    """Measure units that share their maps, with extras of the first only; `renderers` processes
    render images on the fly."""
    first = units[0]
    stranger = None
    if first.stranger is not None:
        with _opened(first.stranger, renderers) as recording:
            truth = Truth.open(recording.path)
            stranger = map_ground(recording, truth, first.setup, first.seed)
    with _opened(first.recording, renderers) as recording:
        truth = Truth.open(recording.path)
        close_up = CloseUp(recording, truth, first.setup)
        onlookers = [close_up] if first.showcase else []
        maps = map_recording(recording, truth, first.setup, first.seed, first.flight, onlookers)
        tables = [
            _measured(unit, recording, truth, maps, stranger, unit is first) for unit in units
        ]
        showcase = _showcase(close_up, maps, first) if first.showcase else None
    return [
        Finished(table, showcase if unit is first else None)
        for unit, table in zip(units, tables, strict=True)
    ]


@contextmanager
def _opened(recording: Path | Flight, renderers: int) -> Iterator[Recording]:
    """A recording on disk, or one whose images are rendered when they are read."""
    if isinstance(recording, Flight):
        with rendered(recording, renderers) as rendering:
            yield rendering
    else:
        yield Recording.open(recording)


def _measured(
    unit: Unit,
    recording: Recording,
    truth: Truth,
    maps: Maps,
    stranger: GroundPass | None,
    is_first: bool,
) -> ResultTable:
    """The rows of one unit; the pass is that of the first unit's setup."""
    setup, seed = unit.setup, (unit.seed, unit.flight)
    config, protocol = setup.config, unit.protocol
    localized = maps.localized
    if not is_first:
        localized = localize_again(maps, recording, setup, *seed)
    out = RowWriter(recording.scene, *seed, setup.condition(recording.sensors))
    _add_run(out, recording, maps, localized)
    _add_trajectories(out, maps, truth)
    _add_surfaces(out, maps, truth)
    _add_alignments(out, maps, localized, truth)
    _add_sequences(out, unit, maps, localized, truth)
    _add_trials(out, unit, maps, truth)
    add_wide_searches(out, maps.sightings, truth, config, seed, protocol.wide_searches)
    if unit.budget:
        add_error_budget(out, recording, truth, setup, maps, seed)
    if unit.baselines and protocol.baselines:
        add_baselines(out, recording, truth, config, maps, seed, protocol)
    if unit.appearance is not None:
        add_appearance(out, unit.appearance)
    if unit.negatives:
        add_negatives(out, maps, stranger, truth, config, seed, protocol)
    return ResultTable.from_rows(out.rows)


def _showcase(close_up: CloseUp, maps: Maps, unit: Unit) -> Showcase | None:
    """Data of the pictures, with matches of images if the baselines are measured."""
    assert maps.augmented is not None
    match = unit.baselines and unit.protocol.baselines > 0
    return close_up.showcase(maps.tracked, maps.augmented, unit.seed if match else None)


def _add_run(out: RowWriter, recording: Recording, maps: Maps, localized: Localized) -> None:
    out.add("run", "recorded_s", recording.duration_s, "s")
    out.add("run", "processing_s", maps.mapping_s + localized.total_s(), "s")
    out.add("run", "peak_memory_mib", peak_memory_mib(), "MiB")
    for durations_ms in (maps.durations_ms, localized.durations_ms):
        for stage, durations in durations_ms.items():
            for duration in durations:
                out.add("timing", stage, duration, "ms")


def _add_trajectories(out: RowWriter, maps: Maps, truth: Truth) -> None:
    true_pose = {"mav": truth.T_world_mav_camera, "ground": truth.T_world_ground_camera}
    for robot, tracked in maps.tracked.items():
        add_tracking(out, tracked, true_pose[robot])


def _add_surfaces(out: RowWriter, maps: Maps, truth: Truth) -> None:
    for index, sighting in enumerate(maps.sightings):
        surface = sighting.surface
        T_world_camera = truth.T_world_mav_camera(surface.reference_stamp_ns)
        error = surface_error(surface.depth, surface.camera, T_world_camera, truth)
        out.add("surface", "error_median_m", error.median_m, "m", trial=index)
        out.add("surface", "error_p90_m", error.p90_m, "m", trial=index)
        out.add("surface", "completeness", error.completeness, "", trial=index)


def _add_alignments(out: RowWriter, maps: Maps, localized: Localized, truth: Truth) -> None:
    """The pipeline's own alignments, which start from its particles."""
    found = zip(maps.sightings, localized.beliefs, localized.alignments, strict=True)
    for trial, (sighting, belief, alignment) in enumerate(found):
        if alignment is None:
            note = "no position was claimed"
            out.add(ALIGNMENT_STAGE, "accepted", 0.0, "", trial=trial, note=note)
        else:
            poses = {"before": belief.T_ground_mav, "after": alignment.T_ground_mav}
            errors = {when: pose_error(pose, sighting, truth) for when, pose in poses.items()}
            out.add_alignment(alignment, errors, trial, ALIGNMENT_STAGE)


def _add_sequences(
    out: RowWriter, unit: Unit, maps: Maps, localized: Localized, truth: Truth
) -> None:
    length = unit.protocol.sequence_length
    starts = sequence_starts(len(maps.sightings), unit.protocol.sequences, length)
    iterations = Counter[int]()
    own = zip(maps.sightings[:length], localized.beliefs, strict=False)
    for iteration, (sighting, belief) in enumerate(own, 1):
        one = Iteration.of(belief, sighting, truth)
        out.add_belief(belief, one.error, one.squared_mahalanobis, 0, iteration)
        iterations[0] = iteration
    filters = {
        sequence: (start, localizer_rng(unit.seed, unit.flight, sequence))
        for sequence, start in enumerate(starts)
        if sequence > 0
    }
    steps = localize_sequences(maps.sightings, length, truth, unit.setup.config, filters)
    for sequence, event, duration_ms, result in steps:
        if duration_ms is not None:
            out.add("timing", STAGE_OF[type(event)], duration_ms, "ms")
        if result is not None:
            iterations[sequence] += 1
            distance = result.squared_mahalanobis
            out.add_belief(
                result.belief, result.error, distance, sequence, iterations[sequence], REPEATED
            )
    for sequence in range(len(starts)):
        for missing in range(iterations[sequence] + 1, length + 1):
            out.add_no_belief("the flight gave no further aerial map", sequence, missing)


def _add_trials(out: RowWriter, unit: Unit, maps: Maps, truth: Truth) -> None:
    chosen = trial_sightings(len(maps.sightings), unit.protocol.trials)
    if not chosen:
        return
    reference = reference_of(
        unit.setup.reference,
        {robot: tracked.final for robot, tracked in maps.tracked.items()},
        truth,
        np.random.default_rng([unit.seed, unit.flight, 9]),
    )
    for trial, index in enumerate(chosen):
        rng = np.random.default_rng([unit.seed, unit.flight, 2, trial])
        sighting = maps.sightings[index]
        result = refine_sighting(sighting, reference(sighting), unit.setup.config, rng)
        out.add_alignment(result.alignment, result.errors, trial)
        out.add("timing", "icp", result.duration_ms, "ms", trial=trial)

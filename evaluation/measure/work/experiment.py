"""All that is measured on one recording: the surface, the sequences, the refinement trials."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from airground.io.recording import Recording
from evaluation.measure.baselines.measure import add_baselines
from evaluation.measure.close_up import make_showcase
from evaluation.measure.protocol.error_budget import add_error_budget
from evaluation.measure.protocol.mapping_pass import GroundPass, Maps, map_ground, map_recording
from evaluation.measure.protocol.negatives import add_negatives
from evaluation.measure.protocol.trials import (
    Protocol,
    localize_sequences,
    refine_sighting,
    sequence_starts,
    trial_sightings,
)
from evaluation.measure.protocol.wide_search import add_wide_searches
from evaluation.measure.showcase import Showcase
from evaluation.run.onlooker import STAGE_OF
from evaluation.setup.memory import peak_memory_mib
from evaluation.setup.setups import Setup
from evaluation.table.row_writer import RowWriter
from evaluation.table.rows import Row
from evaluation.table.tracking_quality import add_tracking
from evaluation.table.truth_errors import surface_error
from sim.recording.rendered import Flight, rendered
from sim.recording.truth import Truth


@dataclass(frozen=True)
class Task:
    """One recording and the setups that share their maps: the unit of parallel work.

    Attributes:
        recording: Where it is, or what it would be made from, to draw its images on the fly.
        seed, flight: What it was made from; they seed the trials too.
        setups: What to measure; all make the same maps.
        protocol: How much of it.
        showcase: Whether to gather what pictures need, of the first setup.
        budget: Whether to measure what each stage loses, with the first setup.
        renderers: Processes that draw images on the fly.
        baselines: Whether to try the baselines on the first setup's maps.
        negatives: Whether to try the negative cases, likewise.
        stranger: The flight whose ground map is the wrong one there; None leaves that out.
    """

    recording: Path | Flight
    seed: int
    flight: int
    setups: list[Setup]
    protocol: Protocol
    showcase: bool = False
    budget: bool = False
    renderers: int = 1
    baselines: bool = False
    negatives: bool = False
    stranger: Path | Flight | None = None


@dataclass(frozen=True)
class Outcome:
    """What a task found.

    Attributes:
        parts: Its rows, by setup.
        showcase: What pictures need, where it was asked for.
    """

    parts: list[list[Row]]
    showcase: Showcase | None

    @property
    def rows(self) -> list[Row]:
        """All rows, setup by setup."""
        return [row for part in self.parts for row in part]


def run_task(task: Task) -> Outcome:
    """Measure everything that a task asks for."""
    stranger = _stranger(task)
    with _opened(task.recording, task.renderers) as recording:
        return _measured(recording, task, stranger)


@contextmanager
def _opened(recording: Path | Flight, renderers: int) -> Iterator[Recording]:
    """From the disk, or drawn while it is read."""
    if isinstance(recording, Flight):
        with rendered(recording, renderers) as drawn:
            yield drawn
    else:
        yield Recording.open(recording)


def _stranger(task: Task) -> GroundPass | None:
    """The map that is the wrong one for all of the task's sightings."""
    if task.stranger is None:
        return None
    with _opened(task.stranger, task.renderers) as recording:
        return map_ground(recording, Truth.open(recording.path), task.setups[0], task.seed)


def _measured(recording: Recording, task: Task, stranger: GroundPass | None) -> Outcome:
    truth = Truth.open(recording.path)
    maps = map_recording(recording, truth, task.setups[0], task.seed)
    parts: list[list[Row]] = []
    for setup in task.setups:
        out = RowWriter(recording.scene, task.seed, task.flight, setup.condition(recording.sensors))
        _add_run(out, recording, maps)
        _add_trajectories(out, maps, truth)
        _add_surfaces(out, maps, truth)
        _add_sequences(out, maps, truth, setup, task)
        _add_trials(out, maps, truth, setup, task)
        seed = (task.seed, task.flight)
        widely = task.protocol.wide_searches
        add_wide_searches(out, maps.sightings, truth, setup.config, seed, widely)
        if task.budget and setup is task.setups[0]:
            add_error_budget(out, recording, truth, setup, maps, seed)
        if task.baselines and task.protocol.baselines and setup is task.setups[0]:
            counts = (task.protocol.trials, task.protocol.baselines)
            add_baselines(out, recording, truth, setup.config, maps, seed, counts)
        if task.negatives and setup is task.setups[0]:
            add_negatives(out, maps, stranger, truth, setup.config, seed, task.protocol)
        parts.append(out.rows)
    showcase = None
    if task.showcase:
        match = task.baselines and task.protocol.baselines > 0
        showcase = make_showcase(recording, truth, maps, task.setups[0], task.seed, match)
    return Outcome(parts, showcase)


def _add_run(out: RowWriter, recording: Recording, maps: Maps) -> None:
    out.add("run", "recorded_s", recording.duration_s, "s")
    out.add("run", "processing_s", maps.processing_s, "s")
    out.add("run", "peak_memory_mib", peak_memory_mib(), "MiB")
    for stage, durations in maps.durations_ms.items():
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


def _add_sequences(out: RowWriter, maps: Maps, truth: Truth, setup: Setup, task: Task) -> None:
    length = task.protocol.sequence_length
    starts = sequence_starts(len(maps.sightings), task.protocol.sequences, length)
    filters = [
        (start, np.random.default_rng([task.seed, task.flight, 1, sequence]))
        for sequence, start in enumerate(starts)
    ]
    iterations = Counter[int]()
    steps = localize_sequences(maps.sightings, length, truth, setup.config, filters)
    for sequence, event, duration_ms, result in steps:
        if duration_ms is not None:
            out.add("timing", STAGE_OF[type(event)], duration_ms, "ms")
        if result is not None:
            iterations[sequence] += 1
            distance = result.squared_mahalanobis
            out.add_belief(result.belief, result.error, distance, sequence, iterations[sequence])
    for sequence in range(len(filters)):
        for missing in range(iterations[sequence] + 1, length + 1):
            out.add_no_belief("the flight gave no further aerial map", sequence, missing)


def _add_trials(out: RowWriter, maps: Maps, truth: Truth, setup: Setup, task: Task) -> None:
    chosen = trial_sightings(len(maps.sightings), task.protocol.trials)
    for trial, index in enumerate(chosen):
        rng = np.random.default_rng([task.seed, task.flight, 2, trial])
        result = refine_sighting(maps.sightings[index], truth, setup.config, rng)
        out.add_alignment(result.alignment, result.errors, result.duration_ms, trial)

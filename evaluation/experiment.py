"""All that is measured on one recording: the surface, the sequences, the refinement trials."""

from __future__ import annotations

import resource
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from airground.io.recording import Recording
from sim.truth import Truth

from evaluation.mapping_pass import Maps, map_recording
from evaluation.results import Row
from evaluation.setups import Setup
from evaluation.surface_error import surface_error
from evaluation.timing import STAGE_OF
from evaluation.trials import (
    SEQUENCE_LENGTH,
    Iteration,
    localize_sequence,
    refine_sighting,
    sequence_starts,
)


@dataclass(frozen=True)
class Protocol:
    """How much is measured on each recording.

    Attributes:
        sequences: Sequences of 12 aerial maps, spread evenly over the flight.
        trials: Refinements from a noisy start, likewise.
    """

    sequences: int = 7
    trials: int = 12


@dataclass(frozen=True)
class Task:
    """One recording and the setups that share their maps: the unit of parallel work."""

    recording: Path
    setups: list[Setup]
    seed: int
    flight: int
    protocol: Protocol


class Rows:
    """Writes rows of one recording under one condition."""

    def __init__(self, recording: Recording, task: Task, setup: Setup) -> None:
        self.rows: list[Row] = []
        self._scene, self._seed, self._flight = recording.scene, task.seed, task.flight
        self._condition = setup.condition(recording.sensors)

    def add(
        self,
        stage: str,
        metric: str,
        value: float,
        unit: str,
        sequence: int | None = None,
        iteration: int | None = None,
        trial: int | None = None,
        note: str = "",
    ) -> None:
        self.rows.append(
            Row(
                self._scene,
                self._seed,
                self._flight,
                self._condition,
                stage,
                metric,
                float(value),
                unit,
                sequence,
                iteration,
                trial,
                note,
            )
        )


def run_task(task: Task) -> list[Row]:
    """Measure everything that a task asks for."""
    recording = Recording.open(task.recording)
    truth = Truth.open(task.recording)
    maps = map_recording(recording, truth, task.setups[0], task.seed)
    rows: list[Row] = []
    for setup in task.setups:
        out = Rows(recording, task, setup)
        _add_run(out, recording, maps)
        _add_surfaces(out, maps, truth)
        _add_sequences(out, maps, truth, setup, task)
        _add_trials(out, maps, truth, setup, task)
        rows += out.rows
    return rows


def _add_run(out: Rows, recording: Recording, maps: Maps) -> None:
    out.add("run", "recorded_s", recording.duration_s, "s")
    out.add("run", "processing_s", maps.processing_s, "s")
    peak_mib = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    out.add("run", "peak_memory_mib", peak_mib, "MiB")
    for stage, durations in maps.durations_ms.items():
        for duration in durations:
            out.add("timing", stage, duration, "ms")


def _add_surfaces(out: Rows, maps: Maps, truth: Truth) -> None:
    for index, sighting in enumerate(maps.sightings):
        surface = sighting.surface
        T_world_camera = truth.T_world_mav_camera(surface.reference_stamp_ns)
        error = surface_error(surface.depth, surface.camera, T_world_camera, truth)
        out.add("surface", "error_median_m", error.median_m, "m", trial=index)
        out.add("surface", "error_p90_m", error.p90_m, "m", trial=index)
        out.add("surface", "completeness", error.completeness, "", trial=index)


def _add_sequences(out: Rows, maps: Maps, truth: Truth, setup: Setup, task: Task) -> None:
    starts = sequence_starts(len(maps.sightings), task.protocol.sequences)
    for sequence, start in enumerate(starts):
        rng = np.random.default_rng([task.seed, task.flight, 1, sequence])
        sightings = maps.sightings[start : start + SEQUENCE_LENGTH]
        iteration = 0
        for event, duration_ms, result in localize_sequence(sightings, truth, setup.config, rng):
            out.add("timing", STAGE_OF[type(event)], duration_ms, "ms")
            if result is not None:
                iteration += 1
                _add_iteration(out, result, sequence, iteration)
        for missing in range(iteration + 1, SEQUENCE_LENGTH + 1):
            note = "the flight gave no further aerial map"
            out.add("localization", "error_m", np.nan, "m", sequence, missing, note=note)
            out.add("localization", "converged", 0, "", sequence, missing, note=note)


def _add_iteration(out: Rows, result: Iteration, sequence: int, iteration: int) -> None:
    belief = result.belief
    for metric, value, unit, note in (
        ("error_m", result.error_m, "m", ""),
        ("spread_m", belief.spread_m, "m", ""),
        ("converged", belief.converged, "", belief.refusal),
    ):
        out.add("localization", metric, value, unit, sequence, iteration, note=note)


def _add_trials(out: Rows, maps: Maps, truth: Truth, setup: Setup, task: Task) -> None:
    count = min(task.protocol.trials, len(maps.sightings))
    chosen = np.linspace(0, len(maps.sightings) - 1, count).round().astype(int)
    for trial, index in enumerate(chosen):
        rng = np.random.default_rng([task.seed, task.flight, 2, trial])
        result = refine_sighting(maps.sightings[index], truth, setup.config, rng)
        for name, error in (
            ("before", result.before),
            ("after", result.after),
            ("from_truth", result.from_truth),
        ):
            out.add("refinement", f"{name}_translation_m", error.translation_m, "m", trial=trial)
            out.add("refinement", f"{name}_rotation_deg", error.rotation_deg, "deg", trial=trial)
        alignment = result.alignment
        out.add(
            "refinement", "accepted", alignment.accepted, "", trial=trial, note=alignment.refusal
        )
        out.add("timing", "icp", result.duration_ms, "ms", trial=trial)

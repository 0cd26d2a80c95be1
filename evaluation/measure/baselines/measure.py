"""Answers of every baseline to sightings of the refinement trials, and their errors."""

from __future__ import annotations

import importlib
import time
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from airground.config import Config
from airground.core.sighting import Sighting
from airground.io.recording import Recording
from evaluation.measure.baselines.interface import Answer, Baseline, Given
from evaluation.measure.baselines.table import BASELINES
from evaluation.measure.baselines.views import GroundViews, aerial_view
from evaluation.measure.protocol.mapping_pass import Maps
from evaluation.measure.protocol.trials import (
    Protocol,
    noisy_start,
    spread_evenly,
    trial_sightings,
)
from evaluation.table.row_writer import RowWriter
from evaluation.table.truth_errors import pose_error, true_T_ground_mav
from sim.recording.truth import Truth

STAGE = "baseline"
"""Metrics are `NAME_claimed`, `NAME_horizontal_m`, `NAME_translation_m`, `NAME_rotation_deg` and
`NAME_ms`; the note of `NAME_claimed` is the reason why not. `NAME_missing` stands alone where a
module is not installed."""


def add_baselines(
    out: RowWriter,
    recording: Recording,
    truth: Truth,
    config: Config,
    maps: Maps,
    seed: tuple[int, int],
    protocol: Protocol,
) -> None:
    """Write one answer of every baseline asked for to some of the refinement trials.

    Rows have the numbers of these trials; the noisy prior is the start of that trial. `seed` holds
    the seeds of the recording and the flight.
    """
    chosen = trial_sightings(len(maps.sightings), protocol.trials)
    ground_views = GroundViews(recording, maps.tracked["ground"].front_end.live_poses())
    installed = []
    for baseline in baselines_asked(protocol):
        reason = why_not_run(baseline)
        if reason:
            out.add(STAGE, f"{baseline.name}_missing", 1.0, "", note=reason)
        else:
            installed.append(baseline)
    for trial in spread_evenly(len(chosen), protocol.baselines):
        sighting = maps.sightings[chosen[trial]]
        answers = ask_all(installed, recording, ground_views, sighting, truth, config, seed, trial)
        for baseline, (answer, duration_ms) in zip(installed, answers, strict=True):
            _add_answer(out, baseline.name, answer, duration_ms, sighting, truth, trial)


def baselines_asked(protocol: Protocol) -> list[Baseline]:
    """The baselines that `protocol` asks for, in the order of the table."""
    return [baseline for baseline in BASELINES if baseline.views or not protocol.only_images]


def ask_all(
    baselines: Sequence[Baseline],
    recording: Recording,
    ground_views: GroundViews,
    sighting: Sighting,
    truth: Truth,
    config: Config,
    seed: tuple[int, int],
    trial: int,
) -> list[tuple[Answer, float]]:
    """Each baseline's answer to one sighting, and its time without reading images [ms]."""
    true = true_T_ground_mav(sighting, truth)
    noisy = noisy_start(true, sighting.T_mav_camera, np.random.default_rng([*seed, 2, trial]))
    priors = {"none": None, "noisy": noisy, "truth": true}
    plain = Given(sighting, config, np.random.default_rng(0))
    with_views = plain
    if any(baseline.views for baseline in baselines):
        views = ground_views.nearest(sighting, noisy)
        with_views = replace(
            plain, aerial_view=aerial_view(recording, sighting), ground_views=views
        )
    answers = []
    for baseline in baselines:
        given = replace(
            with_views if baseline.views else plain,
            prior=priors[baseline.prior],
            rng=np.random.default_rng([*seed, 5, trial]),
        )
        started = time.perf_counter()
        answer = baseline.locate(given)
        answers.append((answer, (time.perf_counter() - started) * 1e3))
    return answers


def _add_answer(
    out: RowWriter,
    name: str,
    answer: Answer,
    duration_ms: float,
    sighting: Sighting,
    truth: Truth,
    trial: int,
) -> None:
    errors = (np.nan, np.nan, np.nan)
    if answer.T_ground_mav is not None:
        error = pose_error(answer.T_ground_mav, sighting, truth)
        errors = (error.horizontal_m, error.translation_m, error.rotation_deg)
    out.add(STAGE, f"{name}_claimed", answer.claimed, "", trial=trial, note=answer.refusal)
    for what, value in zip(("horizontal_m", "translation_m", "rotation_deg"), errors, strict=True):
        out.add(STAGE, f"{name}_{what}", value, what.rpartition("_")[2], trial=trial)
    out.add(STAGE, f"{name}_ms", duration_ms, "ms", trial=trial)


def why_not_run(baseline: Baseline) -> str:
    """What is not installed, and how to install it; empty if the baseline can run.
    Imports and loads what it needs, so that the time of its first answer does not include that."""
    try:
        if baseline.module:
            importlib.import_module(baseline.module)
        if baseline.prepare is not None:
            baseline.prepare()
    except ImportError as error:
        return f"{error.name or baseline.module} is not installed: {baseline.install}"
    return ""

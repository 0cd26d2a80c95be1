"""The paper's experiments on recorded sightings: sequences (Fig. 11, 12), trials (Fig. 13, 14)."""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from airground.config import Config
from airground.core.belief import Alignment, Belief
from airground.core.events import BeliefUpdated, CostMapComputed, Event, HeightMapsMade
from airground.core.se3 import SE3
from airground.core.sighting import Sighting
from airground.localization.height_map_pair import HeightMapPair
from airground.localization.particle_filter import MonteCarloLocalizer
from airground.pipeline import pair_of
from airground.refinement import refine
from evaluation.run.onlooker import timed
from evaluation.table.truth_errors import (
    PoseError,
    pose_error,
    relative_error,
    squared_mahalanobis,
)
from sim.recording.truth import Truth

SEQUENCE_LENGTH = 12
"""Aerial maps in a sequence (Sec. VIII-C)."""

START_NOISE_M, START_NOISE_DEG = 0.2, 3.0
"""Standard deviation per axis of the start of a refinement trial [m, deg] (Sec. VIII-D)."""


@dataclass(frozen=True)
class Protocol:
    """Numbers of experiments on each recording, spread evenly over the flight.

    Attributes:
        sequences: Number of sequences of aerial maps.
        trials: Number of refinements from a noisy start.
        baselines: Number of these trials on which every baseline is measured too.
        only_images: Whether only the baselines that match images are measured.
        sequence_length: Number of aerial maps in a sequence.
        wide_searches: Number of aerial maps that are searched for one by one in a wider region.
    """

    sequences: int = 7
    trials: int = 12
    baselines: int = 0
    only_images: bool = False
    sequence_length: int = SEQUENCE_LENGTH
    wide_searches: int = 0


@dataclass(frozen=True)
class Iteration:
    """One update of a sequence's filter with an aerial map: the belief, its error, and the error in
    the measure of the belief's covariance (`evaluation.judge.claims`)."""

    belief: Belief
    error: PoseError
    squared_mahalanobis: float

    @classmethod
    def of(cls, belief: Belief, sighting: Sighting, truth: Truth) -> Iteration:
        """A belief with its errors."""
        error = pose_error(belief.T_ground_mav, sighting, truth)
        return cls(belief, error, squared_mahalanobis(belief, sighting, truth))


@dataclass(frozen=True)
class RefinementTrial:
    """One alignment from a noisy start.

    Attributes:
        alignment: Result of refinement.
        errors: Errors of the start ("before"), of the result ("after"), and of the result when
            started at the truth ("from_truth"): the limit set by drift and the maps' errors.
        duration_ms: Duration, preparation included [ms].
    """

    alignment: Alignment
    errors: dict[str, PoseError]
    duration_ms: float


def sequence_starts(sightings: int, sequences: int, length: int = SEQUENCE_LENGTH) -> list[int]:
    """Index of the first sighting of each sequence, spread evenly over a flight.
    A flight with fewer aerial maps than a sequence gives one; the missing ones count as failed."""
    last = max(0, sightings - length)
    return sorted({round(start) for start in np.linspace(0, last, sequences)})


def trial_sightings(sightings: int, trials: int) -> list[int]:
    """Indices of the sightings of refinement trials: spread evenly, each at most once."""
    return spread_evenly(sightings, min(trials, sightings))


def spread_evenly(total: int, count: int) -> list[int]:
    """`count` indices below `total`, the first and the last included."""
    return [round(index) for index in np.linspace(0, total - 1, min(count, total))]


def localize_sequence(
    sightings: Sequence[Sighting], truth: Truth, config: Config, rng: np.random.Generator
) -> Iterator[tuple[Event, float, Iteration | None]]:
    """Update a new filter with the sightings.

    Yields:
        Each event, its duration [ms], and the iteration that it completes, if any.
    """
    localizer = MonteCarloLocalizer(config, rng)
    for sighting in sightings:
        yield from _update(localizer, pair_of(sighting, config), sighting, truth)


def localize_sequences(
    sightings: Sequence[Sighting],
    length: int,
    truth: Truth,
    config: Config,
    filters: Mapping[int, tuple[int, np.random.Generator]],
) -> Iterator[tuple[int, Event, float | None, Iteration | None]]:
    """Run overlapping sequences together, each with the results of `localize_sequence`.

    Results that depend on the maps alone are computed once for all sequences with the same aerial
    surfaces: with a searched heading, these take nearly all of the time.

    Args:
        sightings: Sightings of a flight.
        length: Number of sightings in a sequence.
        truth: Reference of all errors.
        config: Configuration of all filters.
        filters: Start and source of random numbers of each sequence, by its number.

    Yields:
        The number of the sequence, its next event, the event's duration [ms] (None if another
        sequence computed it), and the iteration that it completes, if any.
    """
    localizers = {
        sequence: MonteCarloLocalizer(config, rng) for sequence, (_, rng) in filters.items()
    }
    for index, sighting in enumerate(sightings):
        pair, computed = pair_of(sighting, config), set[tuple[type[Event], int]]()
        for sequence, (start, _) in filters.items():
            if start <= index < start + length:
                surfaces = min(index - start + 1, config.localization.maps_together)
                steps = _update(localizers[sequence], pair, sighting, truth)
                for event, duration_ms, iteration in steps:
                    again = (type(event), surfaces) in computed
                    yield sequence, event, None if again else duration_ms, iteration
                    if isinstance(event, (HeightMapsMade, CostMapComputed)):
                        computed.add((type(event), surfaces))


def _update(
    localizer: MonteCarloLocalizer, pair: HeightMapPair, sighting: Sighting, truth: Truth
) -> Iterator[tuple[Event, float, Iteration | None]]:
    for event, duration_ms in timed(localizer.update(pair)):
        iteration = None
        if isinstance(event, BeliefUpdated):
            iteration = Iteration.of(event.belief, sighting, truth)
        yield event, duration_ms, iteration


def noisy_start(T_ground_mav: SE3, T_mav_camera: SE3, rng: np.random.Generator) -> SE3:
    """The true `T_ground_mav` with noise on the MAV's camera pose (`START_NOISE_M`, `_DEG`)."""
    T_ground_camera = T_ground_mav @ T_mav_camera
    turn = SE3.from_rotation_vector(np.deg2rad(rng.normal(0, START_NOISE_DEG, 3)))
    T_noisy = SE3(
        (turn @ SE3(T_ground_camera.rotation, np.zeros(3))).rotation,
        T_ground_camera.translation + rng.normal(0, START_NOISE_M, 3),
    )
    return T_noisy @ T_mav_camera.inverse()


def refine_sighting(
    sighting: Sighting, reference: SE3, config: Config, rng: np.random.Generator
) -> RefinementTrial:
    """Refine from a noisy start, and from the truth; `reference` is the true `T_ground_mav`, or
    what a trial takes for it."""
    start = noisy_start(reference, sighting.T_mav_camera, rng)
    started = time.perf_counter()
    alignment = refined(sighting, start, config)
    duration_ms = (time.perf_counter() - started) * 1e3
    poses = {
        "before": start,
        "after": alignment.T_ground_mav,
        "from_truth": refined(sighting, reference, config).T_ground_mav,
    }
    errors = {
        when: relative_error(pose, reference, sighting.T_mav_camera) for when, pose in poses.items()
    }
    return RefinementTrial(alignment, errors, duration_ms)


def refined(sighting: Sighting, start: SE3, config: Config) -> Alignment:
    """Alignment of a sighting's two maps, from a start."""
    surface = sighting.surface
    return refine(surface.stamp_ns, start, surface.cloud_mav, sighting.ground_cloud, config)

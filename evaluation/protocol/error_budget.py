"""Which stage loses what: the final error with each stage in turn replaced by its oracle.

Every stand-in passes all sightings of a flight through one particle filter and refines its
estimates, as the pipeline does; only what it names is true. Differences between the rows
are what that stage costs, not parts of a sum: errors of different stages may hide each other.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from airground.config import Config
from airground.core.events import BeliefUpdated
from airground.core.se3 import SE3
from airground.io.recording import Recording
from airground.localization.particle_filter import MonteCarloLocalizer
from airground.pipeline import Sighting, locate
from airground.refinement import refine
from evaluation.protocol.mapping_pass import Maps, map_recording
from evaluation.protocol.setups import Poses, Setup
from evaluation.protocol.true_stages import (
    with_true_ground_map,
    with_true_heading,
    with_true_surface,
)
from evaluation.results.row_writer import RowWriter
from evaluation.truth.relation import pose_error, true_T_ground_mav
from sim.truth import Truth

STAGE = "budget"
SETTLED = 4
"""Sightings count from this one on, when the filter has had its chance (Sec. VIII-C)."""


@dataclass(frozen=True)
class StandIn:
    """One row of the budget.

    Attributes:
        name: What is true.
        poses: Where the poses come from.
        change: Replaces a stage's result in a sighting; None changes nothing.
        located: Whether refinement starts from the true relation, without particles.
    """

    name: str
    poses: Poses = "slam"
    change: Callable[[Sighting, Truth], Sighting] | None = None
    located: bool = False


STAND_INS = (
    StandIn("nothing: all estimated"),
    StandIn("the MAV's poses", "slam, exact mav"),
    StandIn("the ground robot's poses", "slam, exact ground"),
    StandIn("both robots' poses", "oracle"),
    StandIn("the aerial surface", change=with_true_surface),
    StandIn("the ground map", change=with_true_ground_map),
    StandIn("the heading", change=with_true_heading),
    StandIn("Monte Carlo localization", located=True),
)


def add_error_budget(
    out: RowWriter,
    recording: Recording,
    truth: Truth,
    setup: Setup,
    maps: Maps,
    seed: tuple[int, int],
) -> None:
    """Write the final error of every sighting under every stand-in.

    Args:
        out: Takes rows of the stage "budget"; their note names the stand-in.
        recording: Mapped again for each kind of poses.
        truth: The stand-ins' source.
        setup: With poses from SLAM.
        maps: What `setup` made of the recording.
        seed: Of the recording and the flight; each stand-in draws the same numbers.
    """
    mapped: dict[str, Maps] = {setup.poses: maps}
    for stand_in in STAND_INS:
        if stand_in.poses not in mapped:
            exact = replace(setup, poses=stand_in.poses)
            mapped[stand_in.poses] = map_recording(recording, truth, exact, seed[0])
        sightings = mapped[stand_in.poses].sightings
        rng = np.random.default_rng([*seed, 4])
        for trial, error in enumerate(final_errors(sightings, truth, setup.config, stand_in, rng)):
            for metric, value, unit in zip(
                ("translation_m", "rotation_deg"), error, ("m", "deg"), strict=True
            ):
                out.add(STAGE, metric, value, unit, trial=trial, note=stand_in.name)


def final_errors(
    sightings: Sequence[Sighting],
    truth: Truth,
    config: Config,
    stand_in: StandIn,
    rng: np.random.Generator,
) -> list[tuple[float, float]]:
    """Error of the refined pose [m, deg] at each settled sighting; NaN where there is none."""
    localizer = MonteCarloLocalizer(config, rng)
    errors = []
    for iteration, seen in enumerate(sightings, 1):
        sighting = seen if stand_in.change is None else stand_in.change(seen, truth)
        start: SE3 | None = None
        if stand_in.located:
            start = true_T_ground_mav(sighting, truth)
        else:
            for event in locate(localizer, sighting):
                if isinstance(event, BeliefUpdated) and event.belief.converged:
                    start = event.belief.T_ground_mav
        if iteration >= SETTLED:
            errors.append(_refined_error(sighting, start, truth, config))
    return errors


def _refined_error(
    sighting: Sighting, start: SE3 | None, truth: Truth, config: Config
) -> tuple[float, float]:
    """Not located, or refused, is a failure."""
    failed = (float("nan"), float("nan"))
    if start is None:
        return failed
    surface = sighting.surface
    aligned = refine(surface.stamp_ns, start, surface.cloud_mav, sighting.ground_cloud, config)
    if not aligned.accepted:
        return failed
    error = pose_error(aligned.T_ground_mav, sighting, truth)
    return error.translation_m, error.rotation_deg

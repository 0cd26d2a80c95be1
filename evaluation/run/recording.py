"""One recording through the whole pipeline, measured against the truth as it runs."""

from __future__ import annotations

import time
from collections.abc import Iterable, Sequence
from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from airground.augmentation import AugmentedMap
from airground.core.belief import Belief
from airground.core.cloud import Source
from airground.core.events import (
    Aligned,
    BeliefUpdated,
    Event,
    SurfaceCast,
)
from airground.core.se3 import SE3
from airground.core.trajectory import Trajectory
from airground.io.ply import write_ply
from airground.io.recording import Recording
from airground.io.tum import write_tum
from airground.pipeline import Pipeline, Sighting, sight
from airground.tracking import TrackedFrame
from airground.warm_up import warm_up_mapping
from evaluation.run.drops import DropList, nothing_dropped
from evaluation.run.given_map import enter
from evaluation.run.onlooker import STAGE_OF, Audience, Onlooker, timed
from evaluation.run.tracking import TrackingHere, TrackingTask
from evaluation.run.tracking_process import TrackingApart
from evaluation.setup.environment import settle
from evaluation.setup.memory import peak_memory_mib
from evaluation.setup.progress import step
from evaluation.setup.setups import Setup
from evaluation.table.row_writer import RowWriter
from evaluation.table.rows import ResultTable
from evaluation.table.tracking_log import Tracked
from evaluation.table.tracking_quality import add_tracking
from evaluation.table.truth_errors import pose_error, squared_mahalanobis
from sim.recording.truth import Truth


@dataclass(frozen=True)
class RunResult:
    """What a run leaves.

    Attributes:
        table: Everything measured.
        tracked: What the front ends said, by robot ("mav", "ground").
        augmented: The augmented map.
        T_ground_mav: The newest accepted alignment; None where none was.
    """

    table: ResultTable
    tracked: dict[str, Tracked]
    augmented: AugmentedMap
    T_ground_mav: SE3 | None


def run_recording(
    recording: Recording,
    truth: Truth,
    setup: Setup,
    seed: int,
    drops: DropList | None = None,
    onlookers: Sequence[Onlooker] = (),
    apart: bool = False,
) -> RunResult:
    """Run the pipeline of Figure 4 from the first message to the last.

    The whole run counts as one sequence, with as many iterations as there were aerial maps,
    and every refinement as one trial.

    Args:
        recording: What both robots sensed.
        truth: Measures the result, and makes the poses of oracles.
        setup: How the pipeline is set.
        seed: Of all that is random.
        drops: Which frames to do without, as a live run did.
        onlookers: They see every event; their time counts for no stage, but for the run.
        apart: Track in processes of their own (`TrackingApart`), which is faster; the result is
            the same.
    """
    drops = drops or nothing_dropped(recording)
    measure = Measure(recording, truth, setup, seed, onlookers)
    task = TrackingTask(recording, truth, setup, seed, drops)
    images = sum(len(recording.of(robot).camera_stamps) for robot in Source)
    with (
        TrackingApart(task) if apart else nullcontext(TrackingHere(task)) as tracking,
        step("running", images, "images") as running,
    ):
        # Compiling is no part of what is timed.
        warm_up_mapping(setup.config, np.random.default_rng(0))
        settle()
        tracking.wait_until_ready()
        started = time.perf_counter()
        measure.run(running.along(drops.received(tracking.frames())))
        report = tracking.report()
        # Tracking in processes of its own ends here; what is taken later is taken alone.
        together_mib = peak_memory_mib() + report.peak_memory_mib
        measure.pipeline.mapping.correct_ground(report.ground)
    out = measure.out
    out.add("run", "recorded_s", recording.duration_s, "s")
    out.add("run", "processing_s", time.perf_counter() - started, "s")
    out.add("run", "peak_memory_mib", max(together_mib, peak_memory_mib()), "MiB")
    return measure.result(report.tracked)


def pipeline_rng(seed: int) -> np.random.Generator:
    """Draws what the stages above tracking need."""
    return np.random.default_rng(seed).spawn(2)[1]


def write_run(folder: Path, recording: Recording, result: RunResult) -> None:
    """Write `augmented_map.ply` and the robots' trajectories."""
    augmented = result.augmented
    write_ply(folder / "augmented_map.ply", augmented.cloud_ground, augmented.sources)
    write_trajectories(folder, recording, result.tracked)


def write_trajectories(folder: Path, recording: Recording, tracked: dict[str, Tracked]) -> None:
    """Write `mav.tum` and `ground.tum` as believed at the end, and `*_live.tum` as first said.

    Poses are those of the robot's body, as in the recording's `truth/`, so that
    `evo_ape tum` compares the files as they are; a robot never tracked has none.
    """
    calibrations = {"mav": recording.mav.calibration, "ground": recording.ground.calibration}
    for robot, calibration in calibrations.items():
        T_camera_body = (calibration.T_body_imu @ calibration.T_imu_camera).inverse()
        ways = {robot: tracked[robot].final_poses()}
        ways[f"{robot}_live"] = tracked[robot].front_end.live_poses()
        for name, poses in ways.items():
            if poses:
                bodies = [T_map_camera @ T_camera_body for _, T_map_camera in poses]
                path = Trajectory.from_poses([stamp for stamp, _ in poses], bodies)
                write_tum(folder / f"{name}.tum", path)


class Measure:
    """Runs the pipeline and turns its events into rows.

    Args:
        recording: What both robots sensed.
        truth: What is true.
        setup: How the pipeline is set.
        seed: Of all that is random.
        onlookers: Who watches.

    Attributes:
        pipeline: All stages above tracking.
        out: What was measured.
    """

    def __init__(
        self,
        recording: Recording,
        truth: Truth,
        setup: Setup,
        seed: int,
        onlookers: Sequence[Onlooker] = (),
    ) -> None:
        self.pipeline = Pipeline(
            setup.config,
            recording.mav.calibration,
            recording.ground.calibration,
            pipeline_rng(seed),
        )
        enter(setup.given, self.pipeline)
        condition = setup.condition(recording.sensors)
        self.out = RowWriter(recording.scene, recording.seed, recording.flight, condition)
        self._truth = truth
        self._iterations = self._trials = 0
        self._T_ground_mav: SE3 | None = None
        self._belief: Belief | None = None
        self._sighting: Sighting | None = None
        self._audience = Audience(onlookers)

    def run(self, frames: Iterable[TrackedFrame]) -> None:
        """Take in all frames, in order of time."""
        for event, duration_ms in timed(self.pipeline.run(self._audience.noted(frames))):
            self.take(event, duration_ms)
            self._audience.show(event, duration_ms, self._sighting)

    def result(self, tracked: dict[str, Tracked]) -> RunResult:
        """What the run leaves, once the front ends have finished."""
        if self._iterations == 0:
            self.out.add_no_belief(
                "no aerial map came while both robots knew where they were", 0, 1
            )
        add_tracking(self.out, tracked["mav"], self._truth.T_world_mav_camera)
        add_tracking(self.out, tracked["ground"], self._truth.T_world_ground_camera)
        table = ResultTable.from_rows(self.out.rows)
        return RunResult(table, tracked, self.pipeline.augmented_map(), self._T_ground_mav)

    def take(self, event: Event, duration_ms: float) -> None:
        """Measure what one event tells."""
        match event:
            case SurfaceCast():
                self._sighting = sight(event.surface, self.pipeline.mapping)
            case BeliefUpdated():
                self._take_belief(event.belief)
            case Aligned():
                self._take_alignment(event, duration_ms)
        if type(event) in STAGE_OF and not isinstance(event, Aligned):
            self.out.add("timing", STAGE_OF[type(event)], duration_ms, "ms")

    def _take_belief(self, belief: Belief) -> None:
        self._belief = belief
        self._iterations += 1
        assert self._sighting is not None
        error = pose_error(belief.T_ground_mav, self._sighting, self._truth)
        distance = squared_mahalanobis(belief, self._sighting, self._truth)
        self.out.add_belief(belief, error, distance, 0, self._iterations)

    def _take_alignment(self, event: Aligned, duration_ms: float) -> None:
        alignment = event.alignment
        assert self._sighting is not None
        assert self._belief is not None
        start = {"before": self._belief.T_ground_mav, "after": alignment.T_ground_mav}
        errors = {when: pose_error(T, self._sighting, self._truth) for when, T in start.items()}
        self.out.add_alignment(alignment, errors, duration_ms, self._trials)
        self._trials += 1
        if alignment.accepted:
            self._T_ground_mav = alignment.T_ground_mav

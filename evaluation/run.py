"""One recording through the whole pipeline, measured against the truth as it runs."""

from __future__ import annotations

import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from airground.augmentation import AugmentedMap
from airground.core.belief import Belief
from airground.core.events import (
    Aligned,
    BeliefUpdated,
    Event,
    SurfaceCast,
)
from airground.core.se3 import SE3
from airground.core.trajectory import Trajectory
from airground.io.recording import Recording
from airground.io.tum import write_tum
from airground.pipeline import Pipeline, Sighting, sight, warm_up
from evaluation.experiment import peak_memory_mib
from evaluation.front_ends import front_ends_for
from evaluation.relation import pose_error
from evaluation.results import ResultTable
from evaluation.row_writer import RowWriter
from evaluation.setups import Setup
from evaluation.timing import STAGE_OF, timed
from evaluation.tracking_quality import Tracked, add_tracking
from sim.truth import Truth


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


def run_recording(recording: Recording, truth: Truth, setup: Setup, seed: int) -> RunResult:
    """Run the pipeline of Figure 4 from the first message to the last.

    The whole run counts as one sequence, with as many iterations as there were aerial maps,
    and every refinement as one trial.
    """
    pose_rng, pipeline_rng = np.random.default_rng(seed).spawn(2)
    watched = front_ends_for(setup, recording, truth, pose_rng)
    pipeline = Pipeline(
        setup.config, recording.mav, recording.ground, watched.front_ends(), pipeline_rng
    )
    condition = setup.condition(recording.sensors)
    out = RowWriter(recording.scene, recording.seed, recording.flight, condition)
    measure = _Measure(out, pipeline, truth)
    # Compiling is no part of what is timed.
    warm_up(setup.config, np.random.default_rng(0))
    started = time.perf_counter()
    for event, duration_ms in timed(pipeline.run(recording.messages())):
        measure.take(event, duration_ms)
    out.add("run", "recorded_s", recording.duration_s, "s")
    out.add("run", "processing_s", time.perf_counter() - started, "s")
    out.add("run", "peak_memory_mib", peak_memory_mib(), "MiB")
    if measure.iterations == 0:
        out.add_no_belief("no aerial map came while both robots knew where they were", 0, 1)
    tracked = watched.tracked()
    add_tracking(out, tracked["mav"], truth.T_world_mav_camera)
    add_tracking(out, tracked["ground"], truth.T_world_ground_camera)
    return RunResult(
        ResultTable.from_rows(out.rows),
        tracked,
        pipeline.augmented_map(),
        measure.T_ground_mav,
    )


def write_trajectories(folder: Path, recording: Recording, tracked: dict[str, Tracked]) -> None:
    """Write `mav.tum` and `ground.tum` as believed at the end, and `*_live.tum` as first said.

    Poses are those of the robot's body, as in the recording's `truth/`, so that
    `evo_ape tum` compares the files as they are; a robot never tracked has none.
    """
    calibrations = {"mav": recording.mav, "ground": recording.ground}
    for robot, calibration in calibrations.items():
        T_camera_body = (calibration.T_body_imu @ calibration.T_imu_camera).inverse()
        ways = {robot: tracked[robot].final_poses()}
        ways[f"{robot}_live"] = tracked[robot].front_end.live_poses()
        for name, poses in ways.items():
            if poses:
                bodies = [T_map_camera @ T_camera_body for _, T_map_camera in poses]
                path = Trajectory.from_poses([stamp for stamp, _ in poses], bodies)
                write_tum(folder / f"{name}.tum", path)


class _Measure:
    """Turns events into rows."""

    def __init__(self, out: RowWriter, pipeline: Pipeline, truth: Truth) -> None:
        self.iterations = 0
        self.T_ground_mav: SE3 | None = None
        self._trials = 0
        self._out, self._pipeline, self._truth = out, pipeline, truth
        self._belief: Belief | None = None
        self._sighting: Sighting | None = None

    def take(self, event: Event, duration_ms: float) -> None:
        match event:
            case SurfaceCast():
                self._sighting = sight(event.surface, self._pipeline.mapping)
            case BeliefUpdated():
                self._take_belief(event.belief)
            case Aligned():
                self._take_alignment(event, duration_ms)
        if type(event) in STAGE_OF and not isinstance(event, Aligned):
            self._out.add("timing", STAGE_OF[type(event)], duration_ms, "ms")

    def _take_belief(self, belief: Belief) -> None:
        self._belief = belief
        self.iterations += 1
        assert self._sighting is not None
        error = pose_error(belief.T_ground_mav, self._sighting, self._truth)
        self._out.add_belief(belief, error, 0, self.iterations)

    def _take_alignment(self, event: Aligned, duration_ms: float) -> None:
        alignment = event.alignment
        assert self._sighting is not None
        assert self._belief is not None
        start = {"before": self._belief.T_ground_mav, "after": alignment.T_ground_mav}
        errors = {when: pose_error(T, self._sighting, self._truth) for when, T in start.items()}
        self._out.add_alignment(alignment, errors, duration_ms, self._trials)
        self._trials += 1
        if alignment.accepted:
            self.T_ground_mav = alignment.T_ground_mav

"""One recording through the whole pipeline, measured against the truth as it runs."""

from __future__ import annotations

from array import array
from collections import defaultdict
from collections.abc import Sequence
from contextlib import nullcontext
from dataclasses import dataclass, replace
from pathlib import Path

from airground.augmentation import AugmentedMap
from airground.config import Config
from airground.core.belief import Alignment, Belief
from airground.core.cloud import Source
from airground.core.events import Aligned, BeliefUpdated, NotLocated
from airground.core.se3 import SE3
from airground.core.sighting import Sighting
from airground.io.ply import write_ply
from airground.io.recording import Recording
from evaluation.run.claim_log import CLAIMS, ClaimLog
from evaluation.run.driver import Driven, drive, pipeline_for
from evaluation.run.drops import DropList
from evaluation.run.onlooker import STAGE_OF, Onlooker, Seen
from evaluation.run.tracking import TrackingHere, TrackingTask, localizer_rng, write_paths
from evaluation.run.tracking_apart import TrackingApart
from evaluation.setup.setups import Setup
from evaluation.table.answer_file import write_answers
from evaluation.table.row_writer import RowWriter
from evaluation.table.rows import ResultTable
from evaluation.table.tracking_log import Tracked
from evaluation.table.tracking_quality import add_tracking
from evaluation.table.truth_errors import pose_error, squared_mahalanobis
from sim.recording.truth import Truth


@dataclass(frozen=True)
class RunResult:
    """Outcome of a run.

    Attributes:
        table: All rows.
        tracked: Answers of the front ends, by robot ("mav", "ground").
        augmented: The augmented map.
        T_ground_mav: The newest accepted alignment; None where there is none.
        claims: Poses of the MAV's camera in the ground robot's camera that were claimed, by stamp
            of the MAV's image [ns].
    """

    table: ResultTable
    tracked: dict[str, Tracked]
    augmented: AugmentedMap
    T_ground_mav: SE3 | None
    claims: Sequence[tuple[int, SE3]] = ()


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

    The whole run counts as one sequence, with one iteration per aerial map, and every
    refinement as one trial.

    Args:
        recording: Measurements of both robots.
        truth: Reference of all errors, and source of the oracles' poses.
        setup: Settings of the pipeline.
        seed: Seed of all random numbers.
        drops: Frames to leave out, from a live run.
        onlookers: Consumers of every event; their time counts for the run, not for a stage.
        apart: Whether to track each robot in its own process: faster, with the same result.
    """
    task = TrackingTask(recording, truth, setup, seed, drops)
    pipeline = pipeline_for(recording, setup, localizer_rng(seed, recording.flight))
    rows, claims = RunRows(recording, truth, setup), ClaimLog()
    with TrackingApart(task) if apart else nullcontext(TrackingHere(task)) as tracking:
        driven = drive(recording, tracking, pipeline, setup, [rows, claims, *onlookers])
    rows.add_run(driven)
    result = rows.result(driven.tracked, pipeline.augmented_map())
    return replace(result, claims=claims.claims(driven.tracked))


def measure(path: Path | str, config: Config | None = None, seed: int = 0) -> RunResult:
    """Run the pipeline over a simulated recording and measure it against its truth.

    Args:
        path: Folder of the recording.
        config: The pipeline's parameters; the preset `best` by default.
        seed: Seed of all random numbers.
    """
    recording = Recording.open(path)
    setup = Setup(Config() if config is None else config)
    return run_recording(recording, Truth.open(recording.path), setup, seed)


class RunRows:
    """An onlooker that turns the events of a run into rows, in `out`."""

    def __init__(self, recording: Recording, truth: Truth, setup: Setup) -> None:
        condition = setup.condition(recording.sensors)
        self.out = RowWriter(recording.scene, recording.seed, recording.flight, condition)
        self._recorded_s, self._truth = recording.duration_s, truth
        self._iterations = self._trials = 0
        self._why_not_located = "no surface: no aerial map was made"
        self._belief: Belief | None = None
        self._T_ground_mav: SE3 | None = None
        # A row takes 20 times the memory of its number, and there are several an image.
        self._stages_ms: defaultdict[str, array[float]] = defaultdict(lambda: array("d"))

    def see(self, seen: Seen) -> None:
        """Write the rows of one event."""
        match seen.event:
            case BeliefUpdated(belief=belief) if seen.sighting is not None:
                self._take_belief(belief, seen.sighting)
            case NotLocated(reason=reason):
                self._why_not_located = reason
            case Aligned() as event if seen.sighting is not None:
                self._take_alignment(event.alignment, seen.sighting)
        if type(seen.event) in STAGE_OF:
            self._stages_ms[STAGE_OF[type(seen.event)]].append(seen.duration_ms)

    def add_run(self, driven: Driven) -> None:
        """Write the duration and the memory of the run."""
        self.out.add("run", "recorded_s", self._recorded_s, "s")
        self.out.add("run", "processing_s", driven.processing_s, "s")
        self.out.add("run", "peak_memory_mib", driven.peak_memory_mib, "MiB")

    def add_times(self) -> None:
        """Write the time of each event, by stage."""
        for stage, durations_ms in self._stages_ms.items():
            for duration_ms in durations_ms:
                self.out.add("timing", stage, duration_ms, "ms")
        self._stages_ms.clear()

    def result(self, tracked: dict[str, Tracked], augmented: AugmentedMap) -> RunResult:
        """The outcome of the run, once the front ends have finished."""
        self.add_times()
        if self._iterations == 0:
            self.out.add_no_belief(self._why_not_located, 0, 1)
        add_tracking(self.out, tracked["mav"], self._truth.T_world_mav_camera)
        add_tracking(self.out, tracked["ground"], self._truth.T_world_ground_camera)
        return RunResult(
            ResultTable.from_rows(self.out.rows), tracked, augmented, self._T_ground_mav
        )

    def _take_belief(self, belief: Belief, sighting: Sighting) -> None:
        self._belief = belief
        self._iterations += 1
        error = pose_error(belief.T_ground_mav, sighting, self._truth)
        distance = squared_mahalanobis(belief, sighting, self._truth)
        self.out.add_belief(belief, error, distance, 0, self._iterations)

    def _take_alignment(self, alignment: Alignment, sighting: Sighting) -> None:
        assert self._belief is not None
        poses = {"before": self._belief.T_ground_mav, "after": alignment.T_ground_mav}
        errors = {when: pose_error(T, sighting, self._truth) for when, T in poses.items()}
        self.out.add_alignment(alignment, errors, self._trials)
        self._trials += 1
        if alignment.accepted:
            self._T_ground_mav = alignment.T_ground_mav


def write_run(folder: Path, recording: Recording, result: RunResult) -> None:
    """Write `augmented_map.ply`, `ROBOT.tum` and `ROBOT_live.tum` with poses of the bodies, and
    `claims.tum` where anything was claimed."""
    augmented = result.augmented
    if result.claims:
        write_answers(folder / CLAIMS, result.claims)
    write_ply(folder / "augmented_map.ply", augmented.cloud_ground, augmented.sources)
    for name, tracked in result.tracked.items():
        write_paths(
            folder, name, recording.of(Source[name.upper()]), tracked.front_end, tracked.final
        )

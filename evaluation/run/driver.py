"""The one driver: tracked frames through `Pipeline`, each event timed and shown to onlookers.

`run`, `live`, `reproduce`, `sweep`, the regression suite and the benchmark all run the pipeline
here. What they measure is what an onlooker sees: no stage holds a clock or knows the truth.
"""

from __future__ import annotations

import time
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from airground.core.cloud import Source
from airground.core.events import Sighted, SurfaceCast
from airground.core.sighting import Sighting
from airground.ground_map import FixedMap
from airground.io.robot_recording import Pair
from airground.pipeline import Pipeline
from airground.tracking import TrackedFrame
from airground.warm_up import warm_up_mapping
from evaluation.run.onlooker import Onlooker, Seen, timed
from evaluation.run.tracking import Tracking
from evaluation.setup.environment import settle
from evaluation.setup.memory import peak_memory_mib
from evaluation.setup.progress import step
from evaluation.setup.setups import Setup
from evaluation.table.tracking_log import Tracked


@dataclass(frozen=True, eq=False)
class Driven:
    """What one pass of the pipeline leaves.

    Attributes:
        tracked: Answers of the front ends, by robot ("mav", "ground").
        processing_s: Wall time from the first image to the last event, decoding included [s].
        processor_s: Processor time of all processes in that time [s].
        peak_memory_mib: Sum of the peaks of all processes [MiB].
        tracking_memory_mib: Part of it that tracking processes held [MiB].
    """

    tracked: dict[str, Tracked]
    processing_s: float
    processor_s: float
    peak_memory_mib: float
    tracking_memory_mib: float


def pipeline_for(recording: Pair, setup: Setup, rng: np.random.Generator) -> Pipeline:
    """The shipped pipeline under a setup, with the ground map that the setup gives, if any."""
    mav, ground = recording.mav.calibration, recording.ground.calibration
    pipeline = Pipeline(setup.config, mav, ground, rng)
    if setup.given.ground_map is not None:
        pipeline.mapping.ground_map = FixedMap(setup.given.ground_map)
    return pipeline


def drive(
    recording: Pair,
    tracking: Tracking,
    pipeline: Pipeline,
    setup: Setup,
    onlookers: Sequence[Onlooker],
) -> Driven:
    """Run the pipeline of Figure 4 from the first image to the last.

    Args:
        recording: Recordings of both robots, for the extent of the work.
        tracking: Source of the tracked frames: in this process, in others, or live.
        pipeline: All stages above tracking, from `pipeline_for`.
        setup: The setup of the pipeline: its kernels are compiled before the clock starts.
        onlookers: Consumers of every event, called in this order. Their time counts for the
            whole run, not for a stage.
    """
    images = sum(len(recording.of(robot).camera_stamps) for robot in Source)
    with step("running", images, "images") as running:
        warm_up_mapping(setup.config, np.random.default_rng(0))
        pipeline.mapping.reserve()
        settle()
        tracking.wait_until_ready()
        started_s, processor_s = time.perf_counter(), time.process_time()
        for seen in watched(pipeline, running.along(tracking.frames())):
            for onlooker in onlookers:
                onlooker.see(seen)
    report = tracking.report()
    # Tracking processes end here: later peaks of this process do not coincide with theirs.
    together_mib = peak_memory_mib() + report.peak_memory_mib
    pipeline.mapping.correct_ground(report.ground)
    return Driven(
        tracked=report.tracked,
        processing_s=time.perf_counter() - started_s,
        processor_s=time.process_time() - processor_s + report.processor_s,
        peak_memory_mib=max(together_mib, peak_memory_mib()),
        tracking_memory_mib=report.peak_memory_mib,
    )


def watched(pipeline: Pipeline, frames: Iterable[TrackedFrame]) -> Iterator[Seen]:
    """Every event of the pipeline over these frames, with its circumstances."""
    newest: list[TrackedFrame] = []

    def noted() -> Iterator[TrackedFrame]:
        for frame in frames:
            newest[:] = [frame]
            yield frame

    sighting: Sighting | None = None
    for event, duration_ms in timed(pipeline.run(noted())):
        match event:
            case SurfaceCast():
                sighting = None
            case Sighted():
                sighting = event.sighting
        yield Seen(event, duration_ms, newest[0], sighting)

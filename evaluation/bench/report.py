"""What a benchmark found, as JSON: every figure of the table and of the pictures."""

from __future__ import annotations

from itertools import chain
from typing import Annotated, Literal, Self

import numpy as np
from pydantic import Field

from evaluation.bench.floors import Floor, Speed
from evaluation.bench.machine import LoadAverage
from evaluation.bench.work import Turn
from evaluation.judge.live_summary import LiveSummary
from evaluation.setup.checked_json import Amount, Part

SCHEMA: Literal[1] = 1
KIND = "benchmark"
"""What an error message calls the file."""

Positive = Annotated[int, Field(ge=1)]


class Timing(Part):
    """Times of the calls by the clock, and the median of their processor time.
    `cpu_median_ms` counts all threads; null where it was not measured."""

    n: Positive
    mean_ms: Amount
    median_ms: Amount
    p95_ms: Amount
    least_ms: Amount
    cpu_median_ms: Amount | None = None

    @classmethod
    def of(cls, turns: list[Turn]) -> Self:
        """Of calls that were measured in full."""
        samples = list(chain.from_iterable(turns))
        cpu_median_ms = float(np.median([sample.cpu_ms for sample in samples]))
        return cls.of_times([sample.wall_ms for sample in samples], cpu_median_ms)

    @classmethod
    def of_times(cls, times_ms: list[float], cpu_median_ms: float | None = None) -> Self:
        """Of times by one clock alone."""
        median, p95 = np.percentile(times_ms, [50, 95])
        return cls(
            n=len(times_ms),
            mean_ms=float(np.mean(times_ms)),
            median_ms=float(median),
            p95_ms=float(p95),
            least_ms=min(times_ms),
            cpu_median_ms=cpu_median_ms,
        )


class LaneTiming(Part):
    """A row on a number of cores; `floor_ms` is null where no floor is known."""

    threads: Positive
    timing: Timing
    floor_ms: Amount | None = None


class PeerTiming(Part):
    """Another library on the same data, in turns with the row, on all cores.
    `times_ours` is its time over ours, the median over the rounds; above 1 it is slower."""

    name: str
    differs: str
    timing: Timing
    times_ours: Amount


class RowResult(Part):
    """One line of the table; `lanes` holds one core first, then all.
    `peak_memory_mib` is what the stage adds to its input in memory, null where not counted;
    `missing_peers` are not installed."""

    name: str
    title: str
    group: str
    size: str
    published_ms: Amount | None
    published_on: str
    target_ms: Amount | None
    lanes: tuple[LaneTiming, ...]
    peers: tuple[PeerTiming, ...] = ()
    missing_peers: tuple[str, ...] = ()
    floor: Floor | None = None
    peak_memory_mib: Amount | None = None

    @property
    def best(self) -> LaneTiming:
        return self.lanes[-1]


class RealTime(Part):
    """The whole pipeline with SLAM over the recording, as fast as it goes.
    `peak_memory_mib` is what this added to the processes, `resident_mib` all that the processes
    held after each tenth of the recording."""

    threads: Positive
    recorded_s: Amount
    processing_s: Amount
    cpu_s: Amount
    real_time_factor: Amount
    peak_memory_mib: Amount | None
    resident_mib: tuple[Amount, ...] = ()


class RecordingSpeed(Part):
    """A whole recording made by `airground simulate`, its start included.
    `cpu_s` is the processor time of all processes."""

    scene: str
    sensors: str
    threads: Positive
    recorded_s: Amount
    wall_s: Amount
    cpu_s: Amount
    recorded_s_a_second: Amount
    cpu_ms_an_image: Amount
    mib_a_minute: Amount


class Machine(Part):
    """Where the benchmark ran, and under which load.
    `other_cores` is the mean number of cores that other programs kept busy, null if unknown."""

    cpu: str
    cores: Positive
    speeds: tuple[Speed, ...]
    load_before: LoadAverage
    load_after: LoadAverage
    other_cores: Amount | None


class RecordingInfo(Part):
    scene: str
    seed: int
    sensors: str
    duration_s: Amount


class CurvePointTiming(Part):
    value: float
    timing: Timing


class CurveResult(Part):
    """How a stage grows: time = a value^exponent on the whole, with all cores.
    `exponent` is of the clock's medians, `cpu_exponent` of the processor time's, which other
    programs change little."""

    name: str
    title: str
    parameter: str
    points: tuple[CurvePointTiming, ...]
    exponent: float
    cpu_exponent: float


class BenchReport(Part):
    """A whole benchmark; `live` is null where the recording was not played at its own rate."""

    schema_: Literal[1] = Field(SCHEMA, alias="schema")
    version: str
    git_revision: str
    date: str
    seconds_a_row: Amount
    machine: Machine
    recording: RecordingInfo
    rows: tuple[RowResult, ...]
    pipeline: tuple[RealTime, ...] = ()
    live: LiveSummary | None = None
    recordings: tuple[RecordingSpeed, ...] = ()
    curves: tuple[CurveResult, ...] = ()

    def to_json(self) -> str:
        return self.model_dump_json(by_alias=True, indent=2) + "\n"

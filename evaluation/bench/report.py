"""What a benchmark found, as JSON: every figure of the table and of the pictures."""

from __future__ import annotations

from itertools import chain
from pathlib import Path
from typing import Annotated, Literal, Self

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from evaluation.bench.load import LoadAverage
from evaluation.bench.sampler import Turn
from evaluation.judge.live_summary import LiveSummary
from evaluation.setup.checked_json import read_checked

SCHEMA: Literal[1] = 1

Number = Annotated[float, Field(ge=0, allow_inf_nan=False)]
Count = Annotated[int, Field(ge=1)]


class Part(BaseModel):
    """A frozen group of figures that refuses keys it does not know."""

    model_config = ConfigDict(frozen=True, extra="forbid")


class Timing(Part):
    """What the calls took by the clock, and in the median of processor time.

    `cpu_median_ms` counts all threads; null where it was not measured.
    """

    n: Count
    mean_ms: Number
    median_ms: Number
    p95_ms: Number
    least_ms: Number
    cpu_median_ms: Number | None = None

    @classmethod
    def of(cls, turns: list[Turn]) -> Self:
        """Of calls that were measured in full."""
        samples = list(chain.from_iterable(turns))
        timing = cls.of_times([sample.wall_ms for sample in samples])
        cpu = float(np.median([sample.cpu_ms for sample in samples]))
        return timing.model_copy(update={"cpu_median_ms": cpu})

    @classmethod
    def of_times(cls, times_ms: list[float]) -> Self:
        """Of times by one clock alone."""
        median, p95 = np.percentile(times_ms, [50, 95])
        return cls(
            n=len(times_ms),
            mean_ms=float(np.mean(times_ms)),
            median_ms=float(median),
            p95_ms=float(p95),
            least_ms=min(times_ms),
        )


class LaneTiming(Part):
    """A row with so many cores; `floor_ms` is null where nobody can say."""

    threads: Count
    timing: Timing
    floor_ms: Number | None = None


class PeerTiming(Part):
    """Another library on the same data, in turns with the row, on all cores.

    `times_ours` is its time over ours, in the median over the rounds; above 1 it is slower.
    """

    name: str
    differs: str
    timing: Timing
    times_ours: Number


class FloorCounts(Part):
    """What any program must do for one call."""

    bytes_moved: Number
    operations: Number


class RowResult(Part):
    """One line of the table; `lanes` holds one core first, then all.

    `peak_memory_mib` is what the stage adds to its input in memory, null where not counted;
    `missing_peers` are not installed.
    """

    name: str
    title: str
    group: str
    size: str
    published_ms: Number | None
    published_on: str
    target_ms: Number | None
    lanes: list[LaneTiming]
    peers: list[PeerTiming] = []
    missing_peers: list[str] = []
    floor: FloorCounts | None = None
    peak_memory_mib: Number | None = None

    @property
    def best(self) -> LaneTiming:
        """With all cores."""
        return self.lanes[-1]


class RealTime(Part):
    """The whole pipeline with SLAM over the recording, as fast as it goes.

    `peak_memory_mib` is what this added to the process, `resident_mib` all that the process
    held after each tenth of the recording.
    """

    threads: Count
    recorded_s: Number
    processing_s: Number
    cpu_s: Number
    real_time_factor: Number
    peak_memory_mib: Number | None
    resident_mib: list[Number] = []


class LaneSpeed(Part):
    """What so many cores can do, as probed."""

    threads: Count
    bandwidth_gb_s: Number
    arithmetic_gflop_s: Number


class Machine(Part):
    """Where it ran, and what else did.

    `other_cores` is how many cores other programs kept busy meanwhile, null if not known.
    """

    cpu: str
    cores: Count
    speeds: list[LaneSpeed]
    load_before: LoadAverage
    load_after: LoadAverage
    other_cores: Number | None


class RecordingInfo(Part):
    """What was worked on."""

    scene: str
    seed: int
    sensors: str
    duration_s: Number


class CurvePointTiming(Part):
    """A curve at one value."""

    value: float
    timing: Timing


class CurveResult(Part):
    """How a stage grows: time = a value^exponent on the whole, with all cores.

    `exponent` is of the clock's medians, `cpu_exponent` of the processor time's, which other
    programs change little.
    """

    name: str
    title: str
    parameter: str
    points: list[CurvePointTiming]
    exponent: float
    cpu_exponent: float


class BenchReport(Part):
    """A whole benchmark; `live` is null where the recording was not played at its own rate."""

    schema_: Literal[1] = Field(SCHEMA, alias="schema")
    version: str
    git_revision: str
    date: str
    seconds_a_row: Number
    machine: Machine
    recording: RecordingInfo
    rows: list[RowResult]
    pipeline: list[RealTime] = []
    live: LiveSummary | None = None
    curves: list[CurveResult] = []

    model_config = ConfigDict(frozen=True, extra="forbid", populate_by_name=True)

    def to_json(self) -> str:
        return self.model_dump_json(by_alias=True, indent=2) + "\n"

    @classmethod
    def read(cls, path: Path) -> Self:
        """Read a file that a benchmark wrote.

        Raises:
            InputError: It is none, or of another version.
        """
        return read_checked(cls, path, "benchmark")

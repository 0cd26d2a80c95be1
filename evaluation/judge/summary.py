"""`summary.json`: the contract that regression checks and other programs read.

A summary is of one condition. All keys are always there. A quantile that failures reach (they
count as infinite) is null, and so is what was not measured: all of `slam` with poses from an
oracle, `realtime` without a live run, `reproduction` with the preset `best`, `level` without one.
"""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path
from typing import Literal, Self, get_args

from pydantic import Field, model_validator

from airground.config import PresetName
from airground.errors import InputError
from evaluation.judge.claims import (
    CalibrationSummary,
    ClaimsSummary,
    calibration_summary,
    claims_summary,
)
from evaluation.judge.live_summary import LiveSummary, live_summary
from evaluation.judge.metrics import METRICS
from evaluation.judge.poses import Slam, SlamRobot
from evaluation.judge.readings import median, rate, rate_of, real_time_factor, spread
from evaluation.judge.reproduction import Reproduced, reproduction_summary
from evaluation.judge.samples import localization, located, refined
from evaluation.setup.checked_json import Count, Number, Part, Share, number, read_checked
from evaluation.setup.condition import Condition, RunInfo
from evaluation.setup.level_mark import LevelMark
from evaluation.table.intervals import Quantiles, quantiles
from evaluation.table.limits import LOCATED_M, NEAR_M
from evaluation.table.rows import ResultTable

SCHEMA: Literal[1] = 1


class Machine(Part):
    cpu: str
    cores: Count


class Surface(Part):
    """Medians over the fused surfaces of their median, 90th percentile and completeness."""

    error_median_m: Number
    error_p90_m: Number
    completeness: Number


class QuantileLists(Part):
    """One entry per iteration."""

    median: list[Number]
    q25: list[Number]
    q75: list[Number]
    p95: list[Number]


class Localization(Part):
    sequences: Count
    iterations: Count
    error_m: QuantileLists
    spread_m: QuantileLists
    within_0_50_m: list[Share]
    within_0_25_m: list[Share]

    @model_validator(mode="after")
    def _one_entry_per_iteration(self) -> Self:
        lists = [self.within_0_50_m, self.within_0_25_m]
        for part in (self.error_m, self.spread_m):
            lists += [part.median, part.q25, part.q75, part.p95]  # type: ignore[list-item]
        if any(len(entries) != self.iterations for entries in lists):
            raise ValueError(f"every list needs one entry per iteration ({self.iterations})")
        return self


class QuantileValues(Part):
    median: Number
    q25: Number
    q75: Number
    p95: Number


class PoseErrors(Part):
    translation_m: QuantileValues
    rotation_deg: QuantileValues


class Refinement(Part):
    trials: Count
    before: PoseErrors
    after: PoseErrors
    within_5cm_2deg: Share | None


class Timing(Part):
    """Times [ms]."""

    mean: Number
    median: Number
    p95: Number
    n: Count


class TimingTable(Part):
    mono_slam: Timing
    rgbd_slam: Timing
    add_frame: Timing
    distance_field: Timing
    fusion: Timing
    ray_cast: Timing
    cost_map: Timing
    particles: Timing
    icp: Timing


class Summary(Part):
    """Everything that `summary.json` holds; docs/formats.md describes the keys."""

    schema_: Literal[1] = Field(alias="schema")
    version: str
    git_revision: str
    preset: PresetName
    poses: Literal["oracle", "slam"]
    seed: int
    level: LevelMark | None = None
    scenes: list[str]
    machine: Machine
    slam: Slam
    surface: Surface
    localization: Localization
    refinement: Refinement
    timing_ms: TimingTable
    real_time_factor: Number
    realtime: LiveSummary | None = None
    claims: ClaimsSummary | None = None
    calibration: CalibrationSummary | None = None
    reproduction: dict[str, Reproduced] | None = None

    def write(self, path: Path) -> None:
        text = json.dumps(self.model_dump(by_alias=True), indent=2, allow_nan=False)
        path.write_text(text + "\n", encoding="utf-8")

    @classmethod
    def read(cls, path: Path) -> Summary:
        """Read and check a summary; raises InputError if the file is missing, no JSON, or breaks
        the contract."""
        return read_checked(cls, path, "summary")


def build_summary(
    table: ResultTable, condition: Condition, run: RunInfo, level: LevelMark | None = None
) -> Summary:
    """Sum up what was measured under one condition (control scenes apart, but for claims).

    Raises:
        InputError: The table has no row under this condition.
    """
    of_condition = table.of(condition)
    measured = of_condition.scored()
    if len(measured) == 0:
        raise InputError(f"results: nothing was measured with {condition.label()}")
    if condition.preset not in get_args(PresetName):
        raise InputError(f"results: unknown preset {condition.preset!r}")
    return Summary(
        schema=SCHEMA,
        version=run.version,
        git_revision=run.git_revision,
        preset=condition.preset,  # type: ignore[arg-type]
        poses="slam" if condition.poses == "slam" else "oracle",
        seed=run.seed,
        level=level,
        scenes=measured.scenes(),
        machine=Machine(cpu=run.cpu, cores=run.cores),
        slam=_slam(measured, condition),
        surface=_surface(measured),
        localization=_localization(measured),
        refinement=_refinement(measured),
        timing_ms=TimingTable(
            **{stage: stage_timing(measured, stage) for stage in TimingTable.model_fields}
        ),
        real_time_factor=number(real_time_factor(measured)),
        realtime=live_summary(measured),
        claims=claims_summary(of_condition),
        calibration=calibration_summary(measured),
        reproduction=None if condition.preset == "best" else reproduction_summary(of_condition),
    )


def _slam(table: ResultTable, condition: Condition) -> Slam:
    if condition.poses != "slam":
        return Slam(mav=SlamRobot(), ground=SlamRobot())
    return Slam(mav=SlamRobot.of(table, "mav"), ground=SlamRobot.of(table, "ground"))


def _surface(table: ResultTable) -> Surface:
    names = ("surface_median", "surface_p90", "completeness")
    middle, p90, completeness = (number(median(METRICS[name], table)) for name in names)
    return Surface(error_median_m=middle, error_p90_m=p90, completeness=completeness)


def _localization(table: ResultTable) -> Localization:
    errors = table.sequences("error_m")
    # Without any sequence there are no iterations either.
    iterations = [int(n) for n in errors.columns] if len(errors) else []
    return Localization(
        sequences=len(errors),
        iterations=len(iterations),
        error_m=_lists([spread(localization("error_m", i), table) for i in iterations]),
        spread_m=_lists([spread(localization("spread_m", i), table) for i in iterations]),
        within_0_50_m=[rate_of(located(i, NEAR_M), table).share for i in iterations],
        within_0_25_m=[rate_of(located(i, LOCATED_M), table).share for i in iterations],
    )


def _refinement(table: ResultTable) -> Refinement:
    def errors(when: str) -> PoseErrors:
        of_position, of_angle = (
            _values(spread(refined(f"{when}_{what}"), table))
            for what in ("translation_m", "rotation_deg")
        )
        return PoseErrors(translation_m=of_position, rotation_deg=of_angle)

    good = rate(METRICS["refined_well"], table)
    return Refinement(
        trials=good.total,
        before=errors("before"),
        after=errors("after"),
        within_5cm_2deg=good.share if good.total else None,
    )


def stage_timing(table: ResultTable, stage: str) -> Timing:
    """Times of a stage, `n` is 0 where it did not run."""
    taken = table.values("timing", stage)
    found = quantiles(taken)
    return Timing(
        mean=float(taken.mean()) if len(taken) else None,
        median=number(found.median),
        p95=number(found.p95),
        n=len(taken),
    )


def _values(found: Quantiles) -> QuantileValues:
    return QuantileValues(**{name: number(value) for name, value in asdict(found).items()})


def _lists(found: list[Quantiles]) -> QuantileLists:
    names = QuantileLists.model_fields
    return QuantileLists(**{name: [number(getattr(one, name)) for one in found] for name in names})

"""`summary.json`: the contract that regression checks and other programs read.

One summary speaks of one condition. A quantile that failures reach (they count as
infinite) is null, and so is whatever was not measured; keys are always there. With an
oracle's poses no SLAM ran, so that all of `slam` is null; without --realtime `realtime` is.
"""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path
from typing import Literal, Self

import numpy as np
from numpy.typing import ArrayLike
from pydantic import Field, model_validator

from airground.errors import InputError
from evaluation.judge.claims import (
    CalibrationSummary,
    ClaimsSummary,
    calibration_summary,
    claims_summary,
)
from evaluation.judge.live_summary import LiveSummary, live_summary
from evaluation.setup.checked_json import Count, Number, Part, Share, number, read_checked
from evaluation.setup.condition import Condition
from evaluation.setup.published import TABLE_I
from evaluation.setup.run_info import RunInfo
from evaluation.table.intervals import quantile, quantiles, rate_within, wilson, with_failures
from evaluation.table.rows import ResultTable

SCHEMA: Literal[1] = 1


class Machine(Part):
    cpu: str
    cores: Count


class SlamRobot(Part):
    """Medians over the runs; `ate` is of live poses, `final_ate` of those believed at the end.

    Scale errors are absolute. `worst` is the largest over the runs, null where one run has no
    trajectory; `nees` is divided by its degrees of freedom, so that 1 is right.
    """

    ate_sim3_rmse_m: Number = None
    ate_se3_rmse_m: Number = None
    scale_error: Number = None
    final_ate_sim3_rmse_m: Number = None
    final_ate_se3_rmse_m: Number = None
    final_scale_error: Number = None
    worst_ate_se3_rmse_m: Number = None
    worst_final_ate_se3_rmse_m: Number = None
    tracked_fraction: Number = None
    least_tracked_fraction: Number = None
    initialized_s: Number = None
    path_m: Number = None
    scale_sigma: Number = None
    nees_position: Number = None
    within_95_position: Number = None
    nees_pose: Number = None
    within_95_pose: Number = None


class Slam(Part):
    mav: SlamRobot
    ground: SlamRobot


class Surface(Part):
    """Medians over the fused surfaces of each one's median, 90th percentile, completeness."""

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
    """Everything `summary.json` holds (DESIGN.md, "What a run leaves")."""

    schema_: Literal[1] = Field(alias="schema")
    version: str
    git_revision: str
    preset: Literal["paper", "best"]
    poses: Literal["oracle", "slam"]
    seed: int
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

    def write(self, path: Path) -> None:
        text = json.dumps(self.model_dump(by_alias=True), indent=2, allow_nan=False)
        path.write_text(text + "\n", encoding="utf-8")

    @classmethod
    def read(cls, path: Path) -> Summary:
        """Read and check a summary.

        Raises:
            InputError: The file is missing, no JSON, or breaks the contract.
        """
        return read_checked(cls, path, "summary")


def build_summary(table: ResultTable, condition: Condition, run: RunInfo) -> Summary:
    """Sum up what was measured under one condition (control scenes apart, but for claims).

    Raises:
        InputError: The table has no row under this condition.
    """
    of_condition = table.of(condition)
    measured = of_condition.without_controls()
    if len(measured) == 0:
        raise InputError(f"results: nothing was measured with {condition.label()}")
    return Summary(
        schema=SCHEMA,
        version=run.version,
        git_revision=run.git_revision,
        preset=condition.preset,  # type: ignore[arg-type]
        poses="slam" if condition.poses == "slam" else "oracle",
        seed=run.seed,
        scenes=measured.scenes(),
        machine=Machine(cpu=run.cpu, cores=run.cores),
        slam=_slam(measured, condition),
        surface=_surface(measured),
        localization=_localization(measured),
        refinement=_refinement(measured),
        timing_ms=_timing(measured),
        real_time_factor=real_time_factor(measured),
        realtime=live_summary(measured),
        claims=claims_summary(of_condition),
        calibration=calibration_summary(measured),
    )


def within_5cm_2deg(table: ResultTable) -> tuple[int, int]:
    """Successes and number of refinement trials; a refused alignment is no success."""
    trials = table.trials()
    if len(trials) == 0:
        return 0, 0
    good = (trials["after_translation_m"] <= 0.05) & (trials["after_rotation_deg"] <= 2.0)
    if "accepted" in trials:
        good &= trials["accepted"] > 0
    return int(good.sum()), len(trials)


def real_time_factor(table: ResultTable) -> float | None:
    """Recorded seconds over processing seconds of all recordings; None where not measured."""
    processing = float(table.values("run", "processing_s").sum())
    return float(table.values("run", "recorded_s").sum()) / processing if processing > 0 else None


def _slam(table: ResultTable, condition: Condition) -> Slam:
    if condition.poses != "slam":
        return Slam(mav=SlamRobot(), ground=SlamRobot())
    return Slam(mav=_slam_robot(table, "mav"), ground=_slam_robot(table, "ground"))


def _slam_robot(table: ResultTable, robot: str) -> SlamRobot:
    made: dict[str, float | None] = {}
    for name in SlamRobot.model_fields:
        metric = name.removeprefix("worst_").removeprefix("least_")
        values = table.values("trajectory", f"{robot}_{metric}")
        if name.endswith("scale_error"):
            values = np.abs(values)
        if name.startswith("worst_"):
            made[name] = number(quantile(values, 1.0))
        elif name.startswith("least_"):
            made[name] = number(quantile(values, 0.0))
        else:
            made[name] = _median(values)
    return SlamRobot(**made)


def _surface(table: ResultTable) -> Surface:
    names = Surface.model_fields
    return Surface(**{name: _median(table.values("surface", name)) for name in names})


def _localization(table: ResultTable) -> Localization:
    errors, spreads = table.sequences("error_m"), table.sequences("spread_m")
    # Without any sequence there are no iterations either.
    iterations = list(errors.columns) if len(errors) else []
    return Localization(
        sequences=len(errors),
        iterations=len(iterations),
        error_m=_lists([errors[i] for i in iterations]),
        spread_m=_lists([spreads[i] for i in iterations]),
        within_0_50_m=[rate_within(errors[i], 0.50).share for i in iterations],
        within_0_25_m=[rate_within(errors[i], 0.25).share for i in iterations],
    )


def _refinement(table: ResultTable) -> Refinement:
    trials = table.trials()
    successes, total = within_5cm_2deg(table)

    def errors(when: str) -> PoseErrors:
        def column(name: str) -> QuantileValues:
            return _values(trials.get(f"{when}_{name}", []))

        return PoseErrors(
            translation_m=column("translation_m"), rotation_deg=column("rotation_deg")
        )

    share = wilson(successes, total).share if total else None
    return Refinement(
        trials=total, before=errors("before"), after=errors("after"), within_5cm_2deg=share
    )


def _timing(table: ResultTable) -> TimingTable:
    entries = {}
    for stage in TABLE_I:
        if stage.in_summary:
            values = table.values("timing", stage.metric)
            spread = quantiles(values)
            entries[stage.metric] = Timing(
                mean=float(values.mean()) if len(values) else None,
                median=number(spread.median),
                p95=number(spread.p95),
                n=len(values),
            )
    return TimingTable(**entries)


def _values(values: ArrayLike) -> QuantileValues:
    return QuantileValues(**{k: number(v) for k, v in asdict(quantiles(values)).items()})


def _lists(columns: list[ArrayLike]) -> QuantileLists:
    spreads = [asdict(quantiles(column)) for column in columns]
    names = QuantileLists.model_fields
    return QuantileLists(**{name: [number(s[name]) for s in spreads] for name in names})


def _median(values: ArrayLike) -> float | None:
    return number(quantiles(with_failures(values)).median)

"""Made-up results of many flights: flights differ, and so do the trials within one."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from evaluation.judge.accepted import Measured
from evaluation.setup.condition import Condition
from evaluation.table.rows import ResultTable, Row

CONDITION = Condition("best", "slam", "nominal", "known")
SURFACES, SEQUENCES, ITERATIONS, TRIALS = 6, 3, 4, 4
TYPICAL = {
    "mav_ate_se3_rmse_m": 0.004,
    "ground_ate_se3_rmse_m": 0.005,
    "error_median_m": 0.0035,
    "error_p90_m": 0.009,
    "error_m": 0.03,
    "spread_m": 0.2,
    "after_translation_m": 0.008,
    "after_rotation_deg": 0.2,
}
"""Medians of errors, by the metric's name in the table."""


def make_results(
    seeds: Iterable[int],
    factors: dict[str, float] | None = None,
    lost: float = 0.02,
    noise: float = 0.0,
) -> ResultTable:
    """One flight a seed over "tiny"; the first seed also flies over "flat".

    Args:
        seeds: Each draws its flight; the same seed gives the same flight.
        factors: What errors are multiplied by, by metric.
        lost: Share of the localizations that end far off.
        noise: How much a change that changes nothing on average moves errors (log-normal).
    """
    factors = factors or {}
    rows: list[Row] = []
    for index, seed in enumerate(seeds):
        rows += _flight("tiny", seed, factors, lost, noise)
        if index == 0:
            rows += _control(seed)
    return ResultTable.from_rows(rows)


def measured(*args: object, **words: object) -> Measured:
    return Measured.of(make_results(*args, **words))  # type: ignore[arg-type]


def _flight(
    scene: str, seed: int, factors: dict[str, float], lost: float, noise: float
) -> list[Row]:
    rng = np.random.default_rng([seed, 1])
    jitter = np.random.default_rng([seed, 2])
    hard = rng.lognormal(0, 0.15)
    rows: list[Row] = []

    def add(stage: str, metric: str, value: float, **where: int) -> None:
        rows.append(Row(scene, seed, 0, CONDITION, stage, metric, float(value), "", **where))  # type: ignore[arg-type]

    def error(metric: str) -> float:
        value = TYPICAL[metric] * hard * rng.lognormal(0, 0.3)
        return value * factors.get(metric, 1.0) * jitter.lognormal(0, noise)

    for robot in ("mav", "ground"):
        metric = f"{robot}_ate_se3_rmse_m"
        add("trajectory", metric, error(metric))
        add("trajectory", f"{robot}_tracked_fraction", 1.0)
    for surface in range(SURFACES):
        add("surface", "error_median_m", error("error_median_m"), trial=surface)
        add("surface", "error_p90_m", error("error_p90_m"), trial=surface)
        add("surface", "completeness", rng.uniform(0.9, 0.97), trial=surface)
    for sequence in range(SEQUENCES):
        for iteration in range(1, ITERATIONS + 1):
            where = {"sequence": sequence, "iteration": iteration}
            far = rng.random() < lost
            add("localization", "error_m", error("error_m") + (0.8 if far else 0.0), **where)
            add("localization", "spread_m", error("spread_m") / iteration, **where)
            add("localization", "converged", float(not far), **where)
    for trial in range(TRIALS):
        add("refinement", "before_translation_m", 0.2, trial=trial)
        add("refinement", "before_rotation_deg", 3.0, trial=trial)
        add("refinement", "after_translation_m", error("after_translation_m"), trial=trial)
        add("refinement", "after_rotation_deg", error("after_rotation_deg"), trial=trial)
        add("refinement", "accepted", 1.0, trial=trial)
    for surface in range(SURFACES):
        add("wide_search", "error_m", error("error_m"), trial=surface)
        add("wide_search", "lead", rng.uniform(0.1, 0.3), trial=surface)
    return rows


def _control(seed: int) -> list[Row]:
    return [
        Row("flat", seed, 0, CONDITION, "localization", metric, value, "", 0, iteration)
        for iteration in range(1, ITERATIONS + 1)
        for metric, value in (("error_m", 1.5), ("converged", 0.0))
    ]

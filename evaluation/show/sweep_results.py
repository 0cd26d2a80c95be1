"""The results of a sweep: its files, and its table on the screen."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import pandas as pd
from rich.console import Console

from evaluation.judge.metrics import Metric
from evaluation.judge.readings import Reading
from evaluation.judge.sweep import SWEPT, Measured
from evaluation.measure.plans.dials import Point, Value, unit_of
from evaluation.measure.plans.sweep import SweepPlan
from evaluation.measure.work.code_version import code_version
from evaluation.setup.run_info import RunInfo
from evaluation.setup.settings import write_config
from evaluation.setup.text import MISSING, TextTable, percent, print_table
from evaluation.show.figures.style import save_figure
from evaluation.show.figures.sweep_curves import sweep_figure

TABLE, SWEEP, CONFIG, FIGURES = "results.parquet", "sweep.json", "config.toml", "figures"
SCHEMA, VERSION = "airground-sweep", 1


def write_sweep(folder: Path, plan: SweepPlan, measured: Sequence[Measured]) -> None:
    """Write table, readings, configuration and figure into an existing folder.

    The same sweep gives the same bytes, whoever measured it and in whatever order.
    """
    _with_dials(measured).to_parquet(folder / TABLE, index=False)
    text = json.dumps(_summary(plan, measured), indent=2, allow_nan=False) + "\n"
    (folder / SWEEP).write_text(text, encoding="utf-8")
    write_config(plan.setup.config, folder / CONFIG)
    save_figure(sweep_figure(plan, measured), folder / FIGURES, "sweep")


def _with_dials(measured: Sequence[Measured]) -> pd.DataFrame:
    """Every row with a column for each dial; a dial that is no number has words there."""
    frames = [at.table.frame.assign(**_columns(at.point)) for at in measured]
    return pd.concat(frames, ignore_index=True)


def _columns(point: Point) -> dict[str, float | str]:
    return {name: _column(value) for name, value in point.items()}


def _column(value: Value) -> float | str:
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    return float(value) if is_number else json.dumps(value)  # type: ignore[arg-type]


def _summary(plan: SweepPlan, measured: Sequence[Measured]) -> dict[str, Any]:
    run = RunInfo.here(plan.seed)
    return {
        "schema": SCHEMA,
        "version": VERSION,
        "airground": run.version,
        "git_revision": run.git_revision,
        "code": code_version(),
        "scenes": [scene.name for scene in plan.scenes],
        "seeds": list(range(plan.seed, plan.seed + plan.flights)),
        "condition": asdict(plan.setup.condition(plan.sensors.name)),
        "dials": [
            {"name": vary.name, "unit": unit_of(vary.name), "values": list(vary.values)}
            for vary in plan.varied
        ],
        "points": [
            {
                "dials": dict(at.point),
                "readings": {name: _numbers(reading) for name, reading in at.readings.items()},
            }
            for at in measured
        ],
    }


def _numbers(reading: Reading) -> dict[str, float | None]:
    """JSON has no infinity: a median that failures reach is null."""
    return {k: v if math.isfinite(v) else None for k, v in asdict(reading).items()}


def print_sweep(
    plan: SweepPlan, measured: Sequence[Measured], console: Console | None = None
) -> None:
    """Print a row for each point: values of the dials, and what is read there."""
    names = [vary.name for vary in plan.varied]
    rows = [
        (
            *(str(at.point[name]) for name in names),
            *(_text(metric, at.readings[key]) for key, metric in SWEPT.items()),
        )
        for at in measured
    ]
    print_table(
        # A screen is narrow.
        TextTable(
            (
                *(name.replace(".", ".\n") for name in names),
                *(m.title.replace(" after", "\nafter") for m in SWEPT.values()),
            ),
            tuple(rows),
        ),
        f"{', '.join(scene.name for scene in plan.scenes)}: "
        + plan.setup.condition(plan.sensors.name).label(),
        "shares or medians with 95 % intervals; failures count as failures",
        console=console,
        left=(),
        bold=range(len(names)),
        compact=True,
    )


def _text(metric: Metric, reading: Reading) -> str:
    if reading.count == 0:
        return MISSING
    value, low, high = (
        percent(number, 0) if metric.share else metric.text(number)
        for number in (reading.value, reading.low, reading.high)
    )
    unit = value.lstrip("0123456789.-")
    return f"{value}\n[{low.removesuffix(unit)}, {high.removesuffix(unit)}]"

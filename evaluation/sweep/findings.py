"""What a sweep found, and the files that it leaves."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import pandas as pd

from evaluation.figures.style import save_figure
from evaluation.figures.sweep_curves import sweep_figure
from evaluation.results.run_info import RunInfo
from evaluation.results.table import CLOCK_STAGES, ResultTable
from evaluation.settings import write_config
from evaluation.sweep.dials import Point, Value, unit_of
from evaluation.sweep.plan import SweepPlan
from evaluation.sweep.readings import Reading, readings
from evaluation.units.code_version import code_version
from evaluation.units.crew import Crew
from evaluation.units.measure import measure
from evaluation.units.store import UnitStore

TABLE, SWEEP, CONFIG, FIGURES = "results.parquet", "sweep.json", "config.toml", "figures"
SCHEMA, VERSION = "airground-sweep", 1


@dataclass(frozen=True)
class Measured:
    """One point of a sweep.

    Attributes:
        point: Where the dials stand.
        table: All rows measured there that do not depend on the machine.
        readings: What they come to.
    """

    point: Point
    table: ResultTable
    readings: dict[str, Reading]


def sweep(plan: SweepPlan, store: UnitStore, crew: Crew) -> list[Measured]:
    """Measure every point that is not measured yet, and read off the quantities.

    Raises:
        InputError: A point cannot be measured.
    """
    points = plan.points()
    units = [plan.units(point) for point in points]
    found = iter(measure([unit for at_point in units for unit in at_point], store, crew))
    measured = []
    for point, at_point in zip(points, units, strict=True):
        table = ResultTable.concat([next(found).table for _ in at_point]).without(CLOCK_STAGES)
        measured.append(Measured(point, table, readings(table.without_controls())))
    return measured


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

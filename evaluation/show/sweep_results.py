"""Results of a sweep: files, figure, and table on the screen."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from rich.console import Console

from evaluation.judge.metrics import Metric
from evaluation.judge.readings import Reading
from evaluation.judge.sweep import SWEPT, Measured
from evaluation.measure.plans.dials import Value, unit_of
from evaluation.measure.plans.sweep import SweepPlan
from evaluation.measure.work.code_version import code_version
from evaluation.setup.condition import RunInfo
from evaluation.setup.settings import write_config
from evaluation.setup.text import MISSING, TextTable, percent, print_table
from evaluation.show.figures.style import LABEL_PT, SERIES, SMALL_PT, WIDE_IN, save_figure, styled

TABLE, SWEEP, CONFIG, FIGURES = "results.parquet", "sweep.json", "config.toml", "figures"
SCHEMA, VERSION = "airground-sweep", 1
COLUMNS = 3
"""Panels side by side in the figure."""


def write_sweep(folder: Path, plan: SweepPlan, measured: Sequence[Measured]) -> None:
    """Write table, readings, configuration and figure into an existing folder.
    The same sweep gives the same bytes, whatever the order of its units."""
    # Each row has a column for each dial.
    rows = [
        at.table.frame.assign(**{name: _column(value) for name, value in at.point.items()})
        for at in measured
    ]
    (folder / TABLE).write_bytes(pd.concat(rows, ignore_index=True).to_parquet(index=False))
    text = json.dumps(_summary(plan, measured), indent=2, allow_nan=False) + "\n"
    (folder / SWEEP).write_text(text, encoding="utf-8")
    write_config(plan.setup.config, folder / CONFIG)
    save_figure(sweep_figure(plan, measured), folder / FIGURES, "sweep")


def _column(value: Value) -> float | str:
    """Value of a dial as a number, or as JSON."""
    return float(value) if _is_number(value) else json.dumps(value)  # type: ignore[arg-type]


def _is_number(value: Value) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


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
    """Print a row for each point: values of the dials, and the readings."""
    names = [vary.name for vary in plan.varied]
    rows = [
        (
            *(str(at.point[name]) for name in names),
            *(_text(metric, at.readings[key]) for key, metric in SWEPT.items()),
        )
        for at in measured
    ]
    # A screen is narrow.
    titles = [name.replace(".", ".\n") for name in names]
    titles += [metric.title.replace(" after", "\nafter") for metric in SWEPT.values()]
    print_table(
        TextTable(tuple(titles), tuple(rows)),
        _conditions(plan),
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


def _conditions(plan: SweepPlan) -> str:
    scenes = ", ".join(scene.name for scene in plan.scenes)
    return f"{scenes}: {plan.setup.condition(plan.sensors.name).label()}"


@styled
def sweep_figure(plan: SweepPlan, measured: Sequence[Measured]) -> Figure:
    """A panel per metric over the first dial; a line for each combination of the others."""
    rows = -(-len(SWEPT) // COLUMNS)
    figure = Figure(figsize=(WIDE_IN, 2.3 * rows), layout="constrained")
    grid = figure.subplots(rows, COLUMNS, squeeze=False).ravel()
    first, *others = (vary.name for vary in plan.varied)
    lines: dict[str, list[Measured]] = {}
    for at in measured:
        label = ", ".join(f"{name} = {at.point[name]}" for name in others)
        lines.setdefault(label, []).append(at)
    places = _places(plan.varied[0].values)
    for axes, key in zip(grid, SWEPT, strict=False):
        for colour, (label, line) in zip(_colours(len(lines)), lines.items(), strict=True):
            x = [places[repr(at.point[first])] for at in line]
            _draw_line(axes, x, [at.readings[key] for at in line], SWEPT[key].share, colour, label)
        _finish(axes, SWEPT[key], first, places)
    for axes in grid[len(SWEPT) :]:
        axes.set_axis_off()
    if others:
        handles, labels = grid[0].get_legend_handles_labels()
        grid[-1].legend(handles, labels, loc="center left", fontsize=SMALL_PT)
    figure.suptitle(_caption(plan, measured), x=0.01, ha="left", fontsize=LABEL_PT)
    return figure


def _draw_line(
    axes: Axes, x: list[float], read: list[Reading], share: bool, colour: Any, label: str
) -> None:
    """Values joined by a line, and their intervals; an infinite value leaves a gap."""
    order = np.argsort(x, kind="stable")
    value, low, high = (
        (100.0 if share else 1.0) * np.array([getattr(reading, part) for reading in read])[order]
        for part in ("value", "low", "high")
    )
    value, high = (np.where(np.isfinite(each), each, np.nan) for each in (value, high))
    at = np.array(x)[order]
    axes.fill_between(at, low, high, color=colour, alpha=0.15, linewidth=0)
    axes.plot(at, value, color=colour, marker="o", markersize=4, linewidth=1.6, label=label)


def _finish(axes: Axes, metric: Metric, dial: str, places: dict[str, float]) -> None:
    if metric.share:
        axes.set_ylim(0, 103)
        axes.set_title(f"% {metric.title}", fontsize=SMALL_PT)
    else:
        axes.set_ylim(bottom=0)
        axes.set_title(f"{metric.title}, median [{metric.unit}]", fontsize=SMALL_PT)
    words = [text.strip("'") for text in places]
    axes.set_xticks(list(places.values()), words, rotation=0 if len(words) < 7 else 45)
    unit = unit_of(dial)
    axes.set_xlabel(f"{dial} [{unit}]" if unit else dial)
    axes.grid(axis="y")


def _places(values: Sequence[Value]) -> dict[str, float]:
    """Place of each value along x: linear, logarithmic over a decade or more; words in turn."""
    if not all(_is_number(value) for value in values):
        return {repr(value): float(index) for index, value in enumerate(values)}
    numbers = {repr(value): float(value) for value in values}  # type: ignore[arg-type]
    if min(numbers.values()) > 0 and max(numbers.values()) >= 10 * min(numbers.values()):
        return {text: float(np.log10(number)) for text, number in numbers.items()}
    return numbers


def _colours(count: int) -> list[Any]:
    if count <= len(SERIES):
        return list(SERIES[:count])
    return [colormaps["viridis"](share) for share in np.linspace(0, 0.95, count)]


def _caption(plan: SweepPlan, measured: Sequence[Measured]) -> str:
    """The conditions, and the number of flights and values at each point."""
    counts = {
        f"{metric.each}s": sorted({at.readings[key].count for at in measured})
        for key, metric in SWEPT.items()
    }
    numbers = ", ".join(
        f"{c[0]} {what}" if c[0] == c[-1] else f"{c[0]} to {c[-1]} {what}"
        for what, c in counts.items()
    )
    flights = len(plan.scenes) * plan.flights
    return f"{_conditions(plan)}\neach point: {flights} flights, {numbers}; 95 % intervals"

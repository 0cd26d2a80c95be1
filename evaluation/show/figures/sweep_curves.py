"""How what is measured depends on a dial: one panel a quantity, with intervals."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from evaluation.judge.metrics import Metric
from evaluation.judge.sweep import SWEPT, Measured
from evaluation.measure.plans.dials import Point, Value, unit_of
from evaluation.show.figures.style import SERIES, SMALL_PT, WIDE_IN, styled

if TYPE_CHECKING:
    from evaluation.measure.plans.sweep import SweepPlan

COLUMNS = 3


@styled
def sweep_figure(plan: SweepPlan, measured: Sequence[Measured]) -> Figure:
    """The first dial along x; a line for each combination of the others."""
    rows = -(-len(SWEPT) // COLUMNS)
    figure = Figure(figsize=(WIDE_IN, 2.3 * rows), layout="constrained")
    grid = figure.subplots(rows, COLUMNS, squeeze=False).ravel()
    first, *others = (vary.name for vary in plan.varied)
    lines: dict[str, list[Measured]] = {}
    for at in measured:
        lines.setdefault(_words(at.point, others), []).append(at)
    places = _places([value for vary in plan.varied[:1] for value in vary.values])
    for axes, (key, metric) in zip(grid, SWEPT.items(), strict=False):
        for colour, (label, line) in zip(_colours(len(lines)), lines.items(), strict=True):
            _curve(axes, key, [places[repr(at.point[first])] for at in line], line, colour)
            axes.lines[-1].set_label(label)
        _finish(axes, metric, first, places)
    for axes in grid[len(SWEPT) :]:
        axes.set_axis_off()
    if others:
        handles, labels = grid[0].get_legend_handles_labels()
        grid[-1].legend(handles, labels, loc="center left", fontsize=SMALL_PT)
    figure.suptitle(_caption(plan, measured), x=0.01, ha="left", fontsize=7.5)
    return figure


def _curve(axes: Axes, key: str, x: list[float], line: list[Measured], colour: object) -> None:
    """Values joined by a line, and their intervals; what is infinite leaves a gap."""
    scale = 100.0 if SWEPT[key].share else 1.0
    read = [at.readings[key] for at in line]
    value, low, high = (
        scale * np.array([getattr(reading, part) for reading in read])
        for part in ("value", "low", "high")
    )
    order = np.argsort(x, kind="stable")
    at = np.array(x)[order]
    finite = np.where(np.isfinite(high), high, np.nan)[order]
    axes.fill_between(at, low[order], finite, color=colour, alpha=0.15, linewidth=0)  # type: ignore[arg-type]
    shown = np.where(np.isfinite(value), value, np.nan)[order]
    axes.plot(at, shown, color=colour, marker="o", markersize=4, linewidth=1.6)  # type: ignore[arg-type]


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


def _places(values: list[Value]) -> dict[str, float]:
    """Where each value stands along x: as a number, by ratio if they span much; else in turn."""
    if any(isinstance(value, bool) or not isinstance(value, int | float) for value in values):
        return {repr(value): float(index) for index, value in enumerate(values)}
    numbers = {repr(value): float(value) for value in values}  # type: ignore[arg-type]
    if min(numbers.values()) > 0 and max(numbers.values()) >= 10 * min(numbers.values()):
        return {text: float(np.log10(number)) for text, number in numbers.items()}
    return numbers


def _colours(count: int) -> list[object]:
    if count <= len(SERIES):
        return list(SERIES[:count])
    return [colormaps["viridis"](share) for share in np.linspace(0, 0.95, count)]


def _words(point: Point, dials: Sequence[str]) -> str:
    return ", ".join(f"{name} = {point[name]}" for name in dials)


def _caption(plan: SweepPlan, measured: Sequence[Measured]) -> str:
    """Under what it was measured, and on how much."""
    condition = plan.setup.condition(plan.sensors.name).label()
    scenes = ", ".join(scene.name for scene in plan.scenes)
    counts = {
        f"{metric.each}s": sorted({at.readings[key].count for at in measured})
        for key, metric in SWEPT.items()
    }
    numbers = ", ".join(
        f"{low} {what}" if low == high else f"{low} to {high} {what}"
        for what, (low, *_, high) in ((what, [c[0], *c]) for what, c in counts.items())
    )
    flights = len(plan.scenes) * plan.flights
    return f"{scenes}: {condition}\neach point: {flights} flights, {numbers}; 95 % intervals"

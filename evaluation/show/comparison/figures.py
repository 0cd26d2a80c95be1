"""The figures of a comparison; every run keeps its colour, the reference has the first."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from evaluation.judge.metrics import WATCHED, Metric
from evaluation.judge.runs import Against, Run
from evaluation.judge.verdict import paired_differences
from evaluation.setup.published import TABLE_I
from evaluation.show.figures.fig06_depth_maps import surface_figure
from evaluation.show.figures.paired_differences import Differences, Panel, paired_differences_figure
from evaluation.show.figures.style import SERIES, ReportFigure
from evaluation.show.figures.table1_timing import time_ratio_figure
from evaluation.show.report.figures import Drawn, localization_figures, refinement_figures
from evaluation.table.rows import ResultTable

_UNITS = {
    "m": ("mm", 1e3),
    "deg": ("deg", 1.0),
    "count": ("", 1.0),
    "cost": ("", 1.0),
    "": ("points of %", 100.0),
}
"""How a change in a metric's unit is drawn."""


def comparison_figures(helds: Sequence[Against]) -> Iterator[ReportFigure]:
    """Draw the figures for which there is data."""
    yield from _differences(helds)
    runs = [helds[0].reference, *(held.run for held in helds)]
    drawn = [
        Drawn(run.measured.condition, run.table.scored(), _plain(run.name), colour)
        for run, colour in zip(runs, SERIES, strict=False)
    ]
    yield from localization_figures(drawn)
    yield from refinement_figures(drawn)
    yield from _surface(drawn)
    yield from _times(runs)


def _differences(helds: Sequence[Against]) -> Iterator[ReportFigure]:
    """Of all runs that have flights in common with the reference."""
    paired = [(held, SERIES[n]) for n, held in enumerate(helds, 1) if held.shared]
    panels = [
        panel
        for metric in WATCHED
        if (panel := _panel(metric, [held for held, _ in paired])) is not None
    ]
    if not panels:
        return
    yield ReportFigure(
        "paired_differences",
        "Paired differences from the reference",
        f"Each run minus {helds[0].reference.name}. A dot is a flight (the median of its "
        "differences, for shares their mean), or a single value where there are too few flights; "
        "the bar is the effect with its 95 % interval. On the shaded side a run is worse. Crosses "
        "count new failures (above) and failures that disappeared (below). Metrics without any "
        "difference are left out.",
        paired_differences_figure(
            panels,
            [_plain(held.run.name) for held, _ in paired],
            [colour for _, colour in paired],
        ),
    )


def _panel(metric: Metric, helds: Sequence[Against]) -> Panel | None:
    """One metric; None where not every run has it, or nothing differs."""
    unit, scale = _UNITS[metric.unit]
    runs = []
    for held in helds:
        (judged,) = [one for one in held.comparison.judged if one.metric == metric]
        if judged.compared is None:
            return None
        before, after = (
            run.measured.only(held.shared).samples[metric.name]
            for run in (held.reference, held.run)
        )
        each, _ = paired_differences(metric, before, after)
        effect = judged.compared.effect
        runs.append(
            Differences(scale * each, scale * effect.value, scale * effect.low, scale * effect.high)
        )
    if not any(one.each.any() for one in runs):
        return None
    title = f"{metric.title} [{unit}]" if unit else metric.title
    return Panel(title, metric.better == "lower", runs)


def _surface(drawn: Sequence[Drawn]) -> Iterator[ReportFigure]:
    metrics = ("error_median_m", "error_p90_m", "completeness")
    shown = [d for d in drawn if len(d.table.values("surface", metrics[0]))]
    if not shown:
        return
    groups = [{d.label: d.table.values("surface", metric) for d in shown} for metric in metrics]
    counts = ", ".join(f"{len(values)} ({label})" for label, values in groups[0].items())
    yield ReportFigure(
        "surface",
        "Fused aerial surfaces",
        "Distance from the true surface, and how many pixels have depth; a box is over all "
        f"surfaces. Surfaces: {counts}.",
        surface_figure(groups[0], groups[1], groups[2], [d.colour for d in shown]),
    )


def _times(runs: Sequence[Run]) -> Iterator[ReportFigure]:
    reference, others = runs[0], runs[1:]
    ratios: dict[str, list[float | None]] = {}
    for stage in TABLE_I:
        before = reference.table.values("timing", stage.metric)
        row = [_ratio(before, run.table, stage.metric) for run in others]
        if any(ratio is not None for ratio in row):
            ratios[stage.title] = row
    if not ratios:
        return
    machines = {(run.summary.machine.cpu, run.summary.machine.cores) for run in runs}
    caveat = (
        "The machines differ, so these ratios do not measure the code."
        if len(machines) > 1
        else "All runs name the same kind of machine; its load at the time is unknown."
    )
    yield ReportFigure(
        "times",
        "Times, as ratios",
        f"Median time of each stage over that of {reference.name}. No verdict: times depend on the "
        f"machine and on its load. {caveat} For times that compare, use airground bench.",
        time_ratio_figure(ratios, [_plain(run.name) for run in others], SERIES[1 : len(runs)]),
    )


def _plain(name: str) -> str:
    """A name from outside as text in figures: a dollar would begin a formula."""
    return name.replace("$", r"\$")


def _ratio(before: np.ndarray, table: ResultTable, metric: str) -> float | None:
    after = table.values("timing", metric)
    if len(before) == 0 or len(after) == 0 or not np.median(before) > 0:
        return None
    ratio = float(np.median(after) / np.median(before))
    return ratio if ratio > 0 else None

"""The report's error budget: a figure and a table."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from evaluation.setup.condition import Condition
from evaluation.setup.text import TextTable, degrees, metres
from evaluation.show.figures.style import SERIES, WIDE_IN, ReportFigure, styled
from evaluation.table.intervals import quantile, wilson
from evaluation.table.limits import GOOD_POSE, is_good_pose
from evaluation.table.rows import ResultTable

Errors = dict[str, tuple[NDArray[np.float64], NDArray[np.float64]]]
"""What is true -> (N,) errors of position [m] and of angle [deg], NaN where no pose was found."""


@styled
def error_budget_figure(errors: Errors) -> Figure:
    """Median as a bar, quartiles as a whisker; the first row's median runs through all."""
    figure = Figure(figsize=(WIDE_IN, 0.28 * len(errors) + 1.2), layout="constrained")
    left, right = figure.subplots(1, 2, sharey=True)
    _bars(left, [1e3 * metres for metres, _ in errors.values()], "position error [mm]")
    _bars(right, [degrees for _, degrees in errors.values()], "angle error [deg]")
    left.set_yticks(range(len(errors)), list(errors))
    left.set_ylim(len(errors) - 0.4, -0.6)
    left.set_title("the truth replaces ...", loc="left")
    return figure


def _bars(axes: Axes, groups: list[NDArray[np.float64]], label: str) -> None:
    medians = [quantile(group, 0.5) for group in groups]
    for row, (group, median) in enumerate(zip(groups, medians, strict=True)):
        if not np.isfinite(median):
            axes.text(0.0, row, " most fail", color=SERIES[0], va="center", fontsize=7.5)
            continue
        low, high = quantile(group, 0.25), quantile(group, 0.75)
        axes.barh(row, median, height=0.55, color=SERIES[0], alpha=0.75 if row else 1.0)
        axes.hlines(row, low, high if np.isfinite(high) else median, color="black", linewidth=1.2)
    if np.isfinite(medians[0]):
        axes.axvline(medians[0], color=SERIES[0], linewidth=1.0, linestyle=(0, (5, 3)))
    axes.set_xlim(left=0)
    axes.set_xlabel(f"{label}: median, quartiles")
    axes.grid(axis="x")


def budget_figure(table: ResultTable, condition: Condition) -> Iterator[ReportFigure]:
    """Of one condition, control scenes apart; nothing where no budget was measured."""
    errors = _errors(table)
    if errors:
        counts = ", ".join(str(len(metres_)) for metres_, _ in errors.values())
        yield ReportFigure(
            "error_budget",
            "Error budget: which stage loses what",
            "Error of the refined pose of the MAV relative to the ground robot, from the fourth "
            "aerial map on, with one stage at a time replaced by the truth. A row shorter than "
            "the first shows what that stage costs; rows do not add up. Poses that were not found "
            f"or were refused count as infinite errors. {condition.label()}; poses in the rows "
            f"from above: {counts}.",
            error_budget_figure(errors),
        )


def budget_table(table: ResultTable) -> TextTable:
    rows = []
    for name, (position, angle) in _errors(table).items():
        good = is_good_pose(position, angle)
        rows.append(
            (
                name,
                f"{metres(quantile(position, 0.5))}\n95 %: {metres(quantile(position, 0.95))}",
                f"{degrees(quantile(angle, 0.5))}\n95 %: {degrees(quantile(angle, 0.95))}",
                wilson(int(good.sum()), len(good)).text(),
            )
        )
    header = ("true is", "position error, median", "angle error, median", f"within {GOOD_POSE}")
    return TextTable(header, tuple(rows))


def _errors(table: ResultTable) -> Errors:
    """Errors by stand-in, in the order measured."""
    off_m, off_deg = (table.rows("budget", what) for what in ("translation_m", "rotation_deg"))

    def of(name: str, rows: pd.DataFrame) -> NDArray[np.float64]:
        return rows[rows["note"] == name]["value"].to_numpy(np.float64)

    return {str(name): (of(name, off_m), of(name, off_deg)) for name in off_m["note"].unique()}

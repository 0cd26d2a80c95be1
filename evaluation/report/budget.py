"""The report's error budget: a figure and a table."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from evaluation.figures.error_budget import error_budget_figure
from evaluation.report.tables import TextTable, degrees, metres, rate
from evaluation.results.condition import Condition
from evaluation.results.table import ResultTable
from evaluation.showcase.figures import ReportFigure
from evaluation.statistics.intervals import quantile, wilson


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
    """One row a stand-in."""
    rows = []
    for name, (position, angle) in _errors(table).items():
        good = (position <= 0.05) & (angle <= 2.0)
        rows.append(
            (
                name,
                f"{metres(quantile(position, 0.5))}\n95 %: {metres(quantile(position, 0.95))}",
                f"{degrees(quantile(angle, 0.5))}\n95 %: {degrees(quantile(angle, 0.95))}",
                rate(wilson(int(good.sum()), len(good))),
            )
        )
    header = ("true is", "position error, median", "angle error, median", "within 5 cm and 2°")
    return TextTable(header, tuple(rows))


def _errors(
    table: ResultTable,
) -> dict[str, tuple[NDArray[np.float64], NDArray[np.float64]]]:
    """Errors by stand-in, in the order measured."""
    made = {}
    for name in table.rows("budget", "translation_m")["note"].unique():
        columns = []
        for metric in ("translation_m", "rotation_deg"):
            rows = table.rows("budget", metric)
            columns.append(rows[rows["note"] == name]["value"].to_numpy(np.float64))
        made[str(name)] = (columns[0], columns[1])
    return made

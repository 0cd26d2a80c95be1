"""The report's table of the paper's figures: published, ours, and whether they come out."""

from __future__ import annotations

from collections.abc import Sequence

from evaluation.judge.readings import Reading
from evaluation.judge.reproduction import FIGURES, PublishedFigure
from evaluation.setup.condition import Condition, short_labels
from evaluation.setup.text import MISSING, TextTable
from evaluation.table.rows import ResultTable


def reproduction_table(table: ResultTable, conditions: Sequence[Condition]) -> TextTable:
    """A row per published figure: the verdict is on the first condition, the others stand beside
    it. No rows where the first condition does not have the paper's constants."""
    header = ("", "paper (real robots)", *short_labels(conditions), "verdict on the first", "")
    if not conditions or conditions[0].preset == "best":
        return TextTable(header, ())
    parts = [table.of(condition) for condition in conditions]
    rows = []
    for figure in FIGURES:
        readings = [figure.reading(part) for part in parts]
        cells = [_cell(figure, reading) for reading in readings]
        head = (f"{figure.figure}: {figure.title}", figure.said)
        rows.append((*head, *cells, figure.verdict(readings[0]), f"interval: {figure.range}"))
    return TextTable(header, tuple(rows))


def _cell(figure: PublishedFigure, found: Reading) -> str:
    """The value; below it its interval and the number of cases."""
    if found.count == 0:
        return MISSING
    low, high = (figure.text(value) for value in (found.low, found.high))
    return f"{figure.text(found.value)}\n{low} to {high}; n = {found.count}"

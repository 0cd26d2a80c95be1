"""Numbers and tables as text: on the screen, in the report and on other pages."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass

from rich import box
from rich.console import Console
from rich.table import Table
from rich.text import Text

MISSING = "-"
"""What was not measured."""
FAILED = "failed"
"""A quantile that failures reach: they count as infinitely large errors."""
FINE_M = 0.1
"""Lengths below this are given in millimetres [m]."""
_MARKS = re.compile(r"[\\|*<`]|(?<![^\W_])_|_(?![^\W_])|(?<=\])\(|&(?=#?\w+;)|~(?=~)")
"""Marks of Markdown that change what a line shows."""


@dataclass(frozen=True)
class TextTable:
    """Cells as text, in rows as long as the header; the first column names the row. What follows a
    line break in a cell is detail."""

    header: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]


def in_brackets(cell: str) -> str:
    """A cell of a `TextTable` as one line, with its detail in brackets."""
    first, *details = cell.split("\n")
    return f"{first} ({'; '.join(details)})" if details else first


def formatted(value: float | None, form: str, infinite: str = FAILED) -> str:
    """A value by a format such as "{:.2f} s"; words where it is missing or infinite."""
    if value is None or math.isnan(value):
        return MISSING
    return infinite if math.isinf(value) else form.format(value)


def metres(value: float | None, decimals: int = 1, sign: str = "") -> str:
    """Millimetres below `FINE_M`, else metres with one more decimal; `sign` "+" for a change."""
    if value is not None and abs(value) < FINE_M:
        return f"{1e3 * value:{sign}.{decimals}f} mm"
    return formatted(value, f"{{:{sign}.{decimals + 1}f}} m")


def degrees(value: float | None, decimals: int = 2, sign: str = "") -> str:
    return formatted(value, f"{{:{sign}.{decimals}f}}°")


def percent(value: float | None, decimals: int = 1, sign: str = "") -> str:
    """A share of 1 in percent."""
    return formatted(None if value is None else 100 * value, f"{{:{sign}.{decimals}f}} %")


def seconds(value: float | None) -> str:
    """Seconds until something happened."""
    return formatted(value, "{:.1f} s", infinite="never")


def milliseconds(value: float | None) -> str:
    """Three digits or so, without the unit."""
    if value is None or not math.isfinite(value):
        return MISSING
    return f"{value:.0f}" if value >= 100 else f"{value:.1f}" if value >= 10 else f"{value:.2f}"


def markdown_text(text: object) -> str:
    """One line of Markdown that shows a text as it is: names in data may hold tags, bars, links and
    line breaks. An underscore inside a word is none of Markdown's marks."""
    return _MARKS.sub(r"\\\g<0>", " ".join(str(text).split()))


def markdown_table(titles: Sequence[object], rows: Sequence[Sequence[object]]) -> list[str]:
    """Lines of a table in Markdown, which shows the cells as they are."""
    cells = [map(markdown_text, line) for line in (titles, *rows)]
    titled, *filled = ["| " + " | ".join(line) + " |" for line in cells]
    return [titled, "| " + " | ".join(["---"] * len(titles)) + " |", *filled]


def print_table(
    table: TextTable,
    title: str = "",
    caption: str = "",
    *,
    console: Console | None = None,
    left: Sequence[int] = (0,),
    bold: Sequence[int] = (),
    styles: Sequence[str] = (),
    compact: bool = False,
) -> None:
    """Print a table with its title above and a caption below.

    Args:
        table: Cells.
        title, caption: Text; empty for none.
        console: Where to print; standard output by default.
        left: Indices of the columns that align left.
        bold: Indices of the columns in bold.
        styles: One rich style per row; empty for none.
        compact: A line under the header only, for wide tables.
    """
    shown = Table(
        title=Text(title) if title else None,
        caption=Text(caption) if caption else None,
        title_justify="left",
        caption_justify="left",
        box=box.SIMPLE_HEAD if compact else box.HEAVY_HEAD,
        padding=(0, 1, 0, 0) if compact else (0, 1),
    )
    for index, heading in enumerate(table.header):
        shown.add_column(
            Text(heading),
            justify="left" if index in left else "right",
            style="bold" if index in bold else "",
            overflow="fold",
        )
    for index, row in enumerate(table.rows):
        shown.add_row(*map(Text, row), style=styles[index] if styles else "")
    (console or Console()).print(shown)

"""The table of where two runs part."""

from __future__ import annotations

from collections.abc import Sequence

from rich.console import Console

from evaluation.judge.divergence import Held, first_divergence
from evaluation.setup.text import MISSING, TextTable, print_table

HEADER = ("", "number", "from [s]", "how much", "small is up to")


def print_differences(
    helds: Sequence[Held], first: str, second: str, console: Console | None = None
) -> None:
    """Print where the second run parts from the first, kind by kind, the earliest one marked."""
    earliest = first_divergence(helds)
    table = TextTable(HEADER, tuple(_row(held) for held in helds))
    styles = ["bold" if held is earliest else "" for held in helds]
    title = f"{second} against {first}: {conclusion(earliest)}"
    print_table(table, title, console=console, left=(0, 3, 4), styles=styles, compact=True)


def conclusion(earliest: Held | None) -> str:
    """Where two runs part, in a few words."""
    if earliest is None or earliest.first is None:
        return "no difference that is more than small"
    return f"the {earliest.kind} differs first, at {seconds_text(earliest.first.stamp_ns)} s"


def seconds_text(stamp_ns: int) -> str:
    """A time of the sensors [s], to the millisecond: images are 33 ms apart."""
    return f"{stamp_ns / 1e9:.3f}"


def _row(held: Held) -> tuple[str, ...]:
    if held.first is None:
        return held.kind, str(held.number), MISSING, "no more than small", held.small
    when = seconds_text(held.first.stamp_ns)
    return held.kind, str(held.number), when, held.first.how_much, held.small

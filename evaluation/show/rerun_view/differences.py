"""The table of where two runs part."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from rich.console import Console

from airground.errors import InputError
from evaluation.judge.accepted import Accepted
from evaluation.judge.divergence import Held, Limits, first_divergence, hold
from evaluation.judge.runs import distinct_names
from evaluation.judge.verdict import Comparison, Judged
from evaluation.judge.worsened import worsened
from evaluation.setup.text import MISSING, TextTable, print_table
from evaluation.show.rerun_view.run_view import RUN_FILE
from evaluation.show.rerun_view.trace import RunFile, check_comparable, read_traces
from evaluation.show.rerun_view.viewer import verify

WORSE = ("metric", "change", "", "from [s]", "how much")
HEADER = ("", "number", "from [s]", "how much", "small is up to")


def hold_files(first: RunFile, second: RunFile, accepted: Path) -> list[Held]:
    """Both runs, kind by kind, by limits of the accepted figures in a file.

    Raises:
        InputError: The runs cannot be held against each other.
    """
    check_comparable(first, second)
    limits = Limits.of(Accepted.read(accepted).measured())
    return hold(*read_traces(first, second), limits)


def hold_folders(reference: Path, run: Path, accepted: Path) -> list[Held]:
    """Both runs, kind by kind; empty where not both folders keep the same recording in rerun."""
    files = [folder / RUN_FILE for folder in (reference, run)]
    if not all(file.is_file() for file in files) or files[0].samefile(files[1]):
        return []
    try:
        for file in files:
            verify(file)
        first, second = map(RunFile.open, files, distinct_names([reference, run]))
        return hold_files(first, second, accepted)
    except InputError:
        return []


def print_worsened(
    comparison: Comparison, helds: Sequence[Held], reference: Path, run: Path
) -> None:
    """Print since when a run differs, for each metric that got worse."""
    if rows := [_worse_row(judged, held) for judged, held in worsened(comparison, helds)]:
        title = f"since when it is worse: airground view {reference} {run}"
        print_table(TextTable(WORSE, tuple(rows)), title, left=(0, 2, 4), compact=True)


def _worse_row(judged: Judged, held: Held) -> tuple[str, ...]:
    change = MISSING
    if judged.compared is not None:
        change = judged.metric.fine_text(judged.compared.effect.value, "+")
    assert held.first is not None
    when = seconds_text(held.first.stamp_ns)
    return judged.metric.title, change, held.kind, when, held.first.how_much


def print_differences(
    helds: Sequence[Held], first: str, second: str, console: Console | None = None
) -> None:
    """Print where the second run parts from the first, kind by kind, the earliest one marked."""
    earliest = first_divergence(helds)
    table = differences_table(helds)
    styles = ["bold" if held is earliest else "" for held in helds]
    title = f"{second} against {first}: {conclusion(earliest)}"
    print_table(table, title, console=console, left=(0, 3, 4), styles=styles, compact=True)


def differences_table(helds: Sequence[Held]) -> TextTable:
    """The first difference of each kind."""
    return TextTable(HEADER, tuple(_row(held) for held in helds))


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

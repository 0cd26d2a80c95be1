"""The files that a run leaves (DESIGN.md, "What a run leaves"), written and read back."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from airground.config import Config
from airground.errors import InputError
from evaluation.report.page import write_report
from evaluation.results.run_info import RunInfo
from evaluation.results.summary import Summary, build_summary
from evaluation.results.table import ResultTable
from evaluation.settings import resolve, write_config
from evaluation.showcase.showcase import Showcase

TABLE, SUMMARY, CONFIG, SHOWCASE = "results.parquet", "summary.json", "config.toml", "showcase"


@dataclass(frozen=True)
class Results:
    """Everything that was measured, and how.

    Attributes:
        table: The measurements; the first condition in it is the primary one.
        config: The primary setup's parameters, as resolved.
        seed: Of all that was random.
        showcase: What pictures are drawn from, where it was gathered.
        notes: What the reader of a report should know.
    """

    table: ResultTable
    config: Config
    seed: int
    showcase: Showcase | None = None
    notes: Sequence[str] = ()

    def write(self, folder: Path) -> Summary:
        """Write table, summary, configuration, report and figures into an existing folder."""
        run = RunInfo.here(self.seed)
        summary = build_summary(self.table, self.table.conditions()[0], run)
        self.table.write(folder / TABLE)
        write_config(self.config, folder / CONFIG)
        if self.showcase is not None:
            self.showcase.save(folder / SHOWCASE)
        write_report(folder, self.table, self.showcase, run, notes=self.notes)
        summary.write(folder / SUMMARY)
        return summary


def read_results(folder: Path) -> Results:
    """Read what `Results.write` wrote.

    Raises:
        InputError: A file is missing or damaged; names it.
    """
    if not folder.is_dir():
        raise InputError(f"{folder}: no such folder; expected what run or reproduce wrote")
    summary = Summary.read(folder / SUMMARY)
    showcase = folder / SHOWCASE
    return Results(
        table=ResultTable.read(folder / TABLE),
        config=resolve(file=folder / CONFIG),
        seed=summary.seed,
        showcase=Showcase.load(showcase) if showcase.is_dir() else None,
    )


def read_table(folder: Path) -> ResultTable:
    """Read only the measurements of what `Results.write` wrote.

    Raises:
        InputError: The folder or its table is missing or damaged; names it.
    """
    if not folder.is_dir():
        raise InputError(f"{folder}: no such folder; expected what run or reproduce wrote")
    return ResultTable.read(folder / TABLE)


def merged(parts: Sequence[Results]) -> Results:
    """Several results as one; the first gives the primary condition and the pictures."""
    first = parts[0]
    showcases = [part.showcase for part in parts if part.showcase is not None]
    return Results(
        table=ResultTable.concat([part.table for part in parts]),
        config=first.config,
        seed=first.seed,
        showcase=showcases[0] if showcases else None,
        notes=[f"Put together from {len(parts)} runs."] if len(parts) > 1 else [],
    )

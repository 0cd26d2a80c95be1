"""The files that a run leaves: names, reading, and several runs as one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from airground.config import Config
from airground.errors import InputError
from evaluation.judge.summary import Summary
from evaluation.measure.showcase import Showcase
from evaluation.setup.settings import resolve
from evaluation.table.rows import ResultTable

TABLE, SUMMARY, CONFIG, SHOWCASE = "results.parquet", "summary.json", "config.toml", "showcase"


@dataclass(frozen=True)
class Results:
    """All measurements, and their parameters.

    Attributes:
        table: The measurements; the first condition in it is the primary one.
        config: The primary setup's parameters, as resolved.
        seed: Seed of everything random.
        showcase: Data of the pictures; None without pictures.
        notes: Sentences for the end of the report.
    """

    table: ResultTable
    config: Config
    seed: int
    showcase: Showcase | None = None
    notes: Sequence[str] = ()


def read_results(folder: Path) -> Results:
    """Read the files of a run; raises InputError where one is missing or damaged."""
    _check_folder(folder)
    seed = Summary.read(folder / SUMMARY).seed
    showcase = folder / SHOWCASE
    return Results(
        table=ResultTable.read(folder / TABLE),
        config=resolve(file=folder / CONFIG),
        seed=seed,
        showcase=Showcase.load(showcase) if showcase.is_dir() else None,
    )


def read_table(folder: Path) -> ResultTable:
    """Read only the measurements of a run; errors as of `read_results`."""
    _check_folder(folder)
    return ResultTable.read(folder / TABLE)


def _check_folder(folder: Path) -> None:
    if not folder.is_dir():
        raise InputError(f"{folder}: no such folder; expected what run or reproduce wrote")


def merged(parts: Sequence[Results]) -> Results:
    """Several results as one; the first gives the primary condition and the pictures.

    Raises:
        InputError: Two of them measured the same flight under the same condition.
    """
    first = parts[0]
    table = ResultTable.concat([part.table for part in parts])
    table.check_once("these runs together")
    showcases = [part.showcase for part in parts if part.showcase is not None]
    return Results(
        table=table,
        config=first.config,
        seed=first.seed,
        showcase=showcases[0] if showcases else None,
        notes=[f"Put together from {len(parts)} runs."] if len(parts) > 1 else [],
    )

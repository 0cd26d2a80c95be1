"""The files that a run leaves: names, reading, and several runs as one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from airground.config import Config
from airground.errors import InputError
from evaluation.judge.summary import Summary
from evaluation.measure.showcase import Showcase
from evaluation.setup.level_mark import LevelMark
from evaluation.setup.settings import resolve
from evaluation.table.rows import ResultTable

TABLE, SUMMARY, CONFIG, SHOWCASE = "results.parquet", "summary.json", "config.toml", "showcase"


@dataclass(frozen=True)
class AtLevel:
    """What was measured at one level of difficulty."""

    level: LevelMark
    table: ResultTable


@dataclass(frozen=True)
class Results:
    """All measurements, and their parameters.

    Attributes:
        table: The measurements; the first condition in it is the primary one.
        config: The primary setup's parameters, as resolved.
        seed: Seed of everything random.
        showcase: Data of the pictures; None without pictures.
        notes: Sentences for the end of the report.
        level: The level of difficulty; None where none was asked for, and for several.
        levels: What was measured at each of several levels, in the order of tables.
    """

    table: ResultTable
    config: Config
    seed: int
    showcase: Showcase | None = None
    notes: Sequence[str] = ()
    level: LevelMark | None = None
    levels: Sequence[AtLevel] = ()


def read_results(folder: Path) -> Results:
    """Read the files of a run; raises InputError where one is missing or damaged."""
    _check_folder(folder)
    summary = Summary.read(folder / SUMMARY)
    showcase = folder / SHOWCASE
    return Results(
        table=ResultTable.read(folder / TABLE),
        config=resolve(file=folder / CONFIG),
        seed=summary.seed,
        showcase=Showcase.load(showcase) if showcase.is_dir() else None,
        level=summary.level,
    )


def read_table(folder: Path) -> ResultTable:
    """Read only the measurements of a run; errors as of `read_results`."""
    _check_folder(folder)
    return ResultTable.read(folder / TABLE)


def read_level(folder: Path) -> LevelMark | None:
    """The level that a run states; errors as of `read_results`."""
    _check_folder(folder)
    return Summary.read(folder / SUMMARY).level


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
        level=first.level if all(part.level == first.level for part in parts) else None,
        levels=_by_level(parts),
    )


def _by_level(parts: Sequence[Results]) -> list[AtLevel]:
    tables: dict[LevelMark, list[ResultTable]] = {}
    for part in parts:
        if part.level is not None:
            tables.setdefault(part.level, []).append(part.table)
    marks = sorted(tables, key=lambda mark: mark.sort_key)
    return [AtLevel(mark, ResultTable.concat(tables[mark])) for mark in marks]

"""Finished units on disk, each in a folder of its own that is whole or not there at all."""

from __future__ import annotations

import json
import os
import shutil
import tempfile
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from evaluation.results.table import ResultTable, Row
from evaluation.showcase.showcase import Showcase

ROWS, MADE_FROM, SHOWCASE = "rows.parquet", "made_from.json", "showcase"
_PARTIAL = ".partial-"


@dataclass(frozen=True)
class Finished:
    """What a unit found."""

    table: ResultTable
    showcase: Showcase | None


class UnitStore:
    """Results by key: `KEY/rows.parquet`, `KEY/made_from.json`, and where asked `KEY/showcase/`.

    Args:
        folder: Where they are kept; it is made if it is not there, and what a killed run left
            half-written in it is removed. Only one process may use it at a time.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        folder.mkdir(parents=True, exist_ok=True)
        for partial in folder.glob(f"{_PARTIAL}*"):
            shutil.rmtree(partial)

    def __contains__(self, key: str) -> bool:
        return (self._folder / key).is_dir()

    def read(self, key: str) -> Finished:
        """What `write` wrote.

        Raises:
            InputError: It is damaged; names the file.
        """
        unit = self._folder / key
        showcase = unit / SHOWCASE
        return Finished(
            ResultTable.read(unit / ROWS),
            Showcase.load(showcase) if showcase.is_dir() else None,
        )

    def write(
        self, key: str, made_from: dict[str, Any], rows: Iterable[Row], showcase: Showcase | None
    ) -> None:
        """Keep what a unit found, for good once this returns.

        Raises:
            OSError: The disk is full or the like: then nothing of it is kept.
        """
        partial = Path(tempfile.mkdtemp(prefix=_PARTIAL, dir=self._folder))
        try:
            ResultTable.from_rows(rows).write(partial / ROWS)
            text = json.dumps(made_from, indent=2, sort_keys=True) + "\n"
            (partial / MADE_FROM).write_text(text, encoding="utf-8")
            if showcase is not None:
                showcase.save(partial / SHOWCASE)
            for path in [*partial.rglob("*"), partial]:
                _flush(path)
            partial.rename(self._folder / key)
            _flush(self._folder)
        except OSError as error:
            if error.errno is not None and error.filename is None:
                raise OSError(error.errno, error.strerror, str(self._folder / key)) from error
            raise
        finally:
            shutil.rmtree(partial, ignore_errors=True)


def _flush(path: Path) -> None:
    """Have a file or the names in a folder reach the disk."""
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)

"""The unit of work: one setup on one flight, its key, and its results on disk."""

from __future__ import annotations

import json
import os
import shutil
import tempfile
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from airground.errors import InputError
from airground.io import layout
from airground.io.digests import bytes_digest, file_digest
from evaluation.measure.protocol.trials import Protocol
from evaluation.measure.showcase import Showcase
from evaluation.measure.work.code_version import code_version
from evaluation.setup.setups import Setup
from evaluation.table.rows import ResultTable
from sim.recording.rendered import Flight

KEY_LENGTH = 32
"""Hexadecimal digits of a key: 128 bits, so that no two units ever share one."""


@dataclass(frozen=True)
class Unit:
    """One setup on one flight, with all that is measured there.

    Attributes:
        recording: Where it is, or what it would be made from.
        seed, flight: What it was made from; they seed the trials too.
        setup: What is measured.
        protocol: How much of it.
        showcase: Whether to gather what pictures need.
        budget: Whether to measure what each stage loses.
        baselines: Whether to try the baselines.
        negatives: Whether to try the cases in which there is nothing to find.
        stranger: The recording whose ground map is the wrong one there, or what it would be made
            from; None leaves that case out.
    """

    recording: Path | Flight
    seed: int
    flight: int
    setup: Setup
    protocol: Protocol
    showcase: bool = False
    budget: bool = False
    baselines: bool = False
    negatives: bool = False
    stranger: Path | Flight | None = None

    def made_from(self) -> dict[str, Any]:
        """Everything that its rows depend on, as JSON can hold it.

        Raises:
            InputError: The recording is not there.
        """
        setup = self.setup
        return {
            "code": code_version(),
            "recording": _described(self.recording),
            "seed": self.seed,
            "flight": self.flight,
            "config": setup.config.model_dump(mode="json"),
            "poses": setup.poses,
            "pose_noise": asdict(setup.noise),
            "variant": setup.variant,
            "protocol": asdict(self.protocol),
            "showcase": self.showcase,
            "budget": self.budget,
            "baselines": self.baselines,
            "negatives": self.negatives,
            "stranger": None if self.stranger is None else _described(self.stranger),
        }

    def key(self) -> str:
        """A digest of `made_from`: units with the same key have the same rows."""
        return key_of(self.made_from())

    @property
    def has_extras(self) -> bool:
        """Whether it asks for what is measured with the first unit of a group alone."""
        return self.showcase or self.budget or self.baselines or self.negatives

    def maps_like(self, other: Unit) -> bool:
        """Whether one pass of mapping serves both."""
        mine, theirs = (
            (unit.recording, unit.seed, unit.flight, unit.protocol) for unit in (self, other)
        )
        return mine == theirs and self.setup.maps_like(other.setup)


def key_of(made_from: dict[str, Any]) -> str:
    """The digest of a description, whatever the order of its entries."""
    text = json.dumps(made_from, sort_keys=True, separators=(",", ":"), allow_nan=False)
    return bytes_digest(text.encode())[:KEY_LENGTH]


def grouped(units: Iterable[Unit]) -> list[list[Unit]]:
    """Units that share their maps, together: drawing and mapping are the expensive part.

    A unit with extras is the first of its group.
    """
    groups: list[list[Unit]] = []
    for unit in units:
        for group in groups:
            if not unit.has_extras and unit.maps_like(group[0]):
                group.append(unit)
                break
        else:
            groups.append([unit])
    return groups


def _described(recording: Path | Flight) -> dict[str, Any]:
    if isinstance(recording, Flight):
        return {
            "scene": recording.scene.model_dump(mode="json"),
            "seed": recording.seed,
            "flight": recording.flight,
            "sensors": asdict(recording.sensors),
            "duration_s": recording.duration_s,
        }
    # The header holds the digests of all other files.
    header = recording / layout.HEADER
    try:
        return {"header": file_digest(header)}
    except OSError as error:
        raise InputError(f"{header}: cannot be read ({error.strerror})") from error


ROWS, MADE_FROM, SHOWCASE = "rows.parquet", "made_from.json", "showcase"
_PARTIAL = ".partial-"


@dataclass(frozen=True)
class Finished:
    """What was measured on a unit, or on several.

    Attributes:
        table: Its rows.
        showcase: Data of the pictures, where it was asked for.
    """

    table: ResultTable
    showcase: Showcase | None = None

    @classmethod
    def merged(cls, parts: Sequence[Finished]) -> Finished:
        """All rows in the order of the parts, and the first showcase among them."""
        showcases = [part.showcase for part in parts if part.showcase is not None]
        table = ResultTable.concat([part.table for part in parts])
        return cls(table, showcases[0] if showcases else None)


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

    def write(self, key: str, made_from: dict[str, Any], finished: Finished) -> None:
        """Keep what a unit found, for good once this returns.

        Raises:
            OSError: The disk is full or the like: then nothing of it is kept.
        """
        partial = Path(tempfile.mkdtemp(prefix=_PARTIAL, dir=self._folder))
        try:
            finished.table.write(partial / ROWS)
            text = json.dumps(made_from, indent=2, sort_keys=True) + "\n"
            (partial / MADE_FROM).write_text(text, encoding="utf-8")
            if finished.showcase is not None:
                finished.showcase.save(partial / SHOWCASE)
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

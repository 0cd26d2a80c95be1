"""The unit of work: one setup on one flight, its key, and its results on disk."""

from __future__ import annotations

import json
import os
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from airground.core.leftovers import remove_left
from airground.errors import InputError
from airground.io import layout
from airground.io.digests import bytes_digest, file_digest
from evaluation.measure.protocol.trials import Protocol
from evaluation.measure.showcase import Showcase
from evaluation.measure.work.code_version import code_version
from evaluation.setup.setups import Setup
from evaluation.table.rows import ResultTable
from sim.partial_folder import PARTIAL, partial_folder
from sim.recording.recorder import Flight

KEY_LENGTH = 32
"""Hexadecimal digits of a key: 128 bits, so that no two units share one."""


@dataclass(frozen=True)
class Unit:
    """One setup on one flight, and what is measured on it.

    Attributes:
        recording: Path of the recording, or the flight that is rendered on the fly.
        seed, flight: Seed of the recording and number of its flight; they also seed the trials.
        setup: Settings of the pipeline.
        protocol: Numbers of sequences and trials.
        showcase: Whether to keep the data of the pictures.
        budget: Whether to measure the error budget.
        baselines: Whether to measure the baselines.
        negatives: Whether to measure the negative cases.
        stranger: Another scene's recording, as `recording`, whose ground map is the wrong map of
            the negative cases; None leaves that case out.
        appearance: The flight in whose world single images are matched under varied appearance;
            None leaves that out.
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
    appearance: Flight | None = None

    def made_from(self) -> dict[str, Any]:
        """Everything that the rows depend on, as JSON data; raises InputError if the recording is
        missing."""
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
            "reference": asdict(setup.reference),
            "protocol": asdict(self.protocol),
            "showcase": self.showcase,
            "budget": self.budget,
            "baselines": self.baselines,
            "negatives": self.negatives,
            "stranger": None if self.stranger is None else _described(self.stranger),
            "appearance": None if self.appearance is None else _described(self.appearance),
        }

    def key(self) -> str:
        """A digest of `made_from`: units with the same key have the same rows."""
        return key_of(self.made_from())

    @property
    def has_extras(self) -> bool:
        """Whether it has measurements that only the first unit of a group may have."""
        asked = self.showcase, self.budget, self.baselines, self.negatives, self.appearance
        return any(extra not in (False, None) for extra in asked)

    def maps_like(self, other: Unit) -> bool:
        """Whether one pass of mapping serves both."""
        mine, theirs = (
            (unit.recording, unit.seed, unit.flight, unit.protocol) for unit in (self, other)
        )
        return mine == theirs and self.setup.maps_like(other.setup)


def key_of(made_from: dict[str, Any]) -> str:
    """Digest of a description, independent of the order of its entries."""
    text = json.dumps(made_from, sort_keys=True, separators=(",", ":"), allow_nan=False)
    return bytes_digest(text.encode())[:KEY_LENGTH]


def grouped(units: Iterable[Unit]) -> list[list[Unit]]:
    """Groups of units that share their maps, since rendering and mapping take most of the time.
    A unit with extras is the first of its group."""
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


@dataclass(frozen=True)
class Finished:
    """Rows of one unit, or of several, and the data of the pictures; None without pictures."""

    table: ResultTable
    showcase: Showcase | None = None

    @classmethod
    def merged(cls, parts: Sequence[Finished]) -> Finished:
        """All rows in the order of the parts, and the first showcase among them."""
        showcases = [part.showcase for part in parts if part.showcase is not None]
        table = ResultTable.concat([part.table for part in parts])
        return cls(table, showcases[0] if showcases else None)


class UnitStore:
    """Results by key: `KEY/rows.parquet`, `KEY/made_from.json`, and optionally `KEY/showcase/`.

    Args:
        folder: Folder of the store, created if missing; partial results of a killed run are
            removed. Only one process may use it at a time.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        folder.mkdir(parents=True, exist_ok=True)
        remove_left(folder, PARTIAL)

    def __contains__(self, key: str) -> bool:
        return (self._folder / key).is_dir()

    def read(self, key: str) -> Finished:
        """The results of a key; raises InputError if a file is damaged."""
        unit = self._folder / key
        showcase = unit / SHOWCASE
        return Finished(
            ResultTable.read(unit / ROWS),
            Showcase.load(showcase) if showcase.is_dir() else None,
        )

    def write(self, key: str, made_from: dict[str, Any], finished: Finished) -> None:
        """Store the results of a unit, on the disk when this returns; raises OSError and stores
        nothing if writing failed, as on a full disk."""
        try:
            with partial_folder(self._folder / key) as partial:
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


def _flush(path: Path) -> None:
    """Write a file, or the names in a folder, through to the disk."""
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)

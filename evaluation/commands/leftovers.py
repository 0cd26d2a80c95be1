"""What killed commands left in a folder and among temporary files, and its removal."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from enum import Enum
from pathlib import Path

from airground.core.leftovers import is_held, mebibytes, named, remove, size_bytes
from airground.core.scratch_folder import SCRATCH_FOLDERS
from airground.errors import AirgroundError, InputError
from airground.io.layout import HEADER
from evaluation.datasets.plan import PLAN
from evaluation.judge.score.benchmark import BENCHMARK
from evaluation.measure.work.out_folder import LOCK, RECORDINGS, RESULTS, SCRATCH, UNITS
from evaluation.measure.work.unit import MADE_FROM
from evaluation.setup.doctor import Finding, Health
from sim.partial_folder import PARTIAL

UNFINISHED = r"\.(?P<name>.+)\.partial"
"""Names of datasets that the same command continues."""
SYSTEM_TEMPORARY = Path("/tmp")
"""Where sockets lie if the name of the folder of temporary files is too long for them."""


class State(Enum):
    """What becomes of a leftover."""

    LEFT = "left by a killed process"
    USED = "in use by a running process"
    CONTINUED = "continued by the same command"


@dataclass(frozen=True)
class Leftover:
    """One unfinished file or folder.

    Attributes:
        path: The file or folder.
        lock: File or folder whose lock its process has.
        size_bytes: Size of all its files [bytes].
        state: Whether it can be removed.
    """

    path: Path
    lock: Path
    size_bytes: int
    state: State


def leftovers(folder: Path) -> list[Leftover]:
    """What is unfinished in a folder, in the results and datasets directly in it, and among the
    temporary files of this user; by name and lock, nothing else.

    Raises:
        InputError: There is no such folder.
    """
    if not folder.is_dir():
        raise InputError(f"{folder}: no such folder; expected one that may hold leftovers")
    places = dict.fromkeys((Path(tempfile.gettempdir()), SYSTEM_TEMPORARY))
    temporary = [path for place in places for path in named(place, SCRATCH_FOLDERS)]
    return [*_in_folder(folder), *(_one(path) for path in temporary if _is_mine(path))]


def clean(found: list[Leftover]) -> list[Leftover]:
    """Remove what no live process uses, under its lock; returns what was removed.

    Raises:
        AirgroundError: Something cannot be removed.
    """
    removed = []
    for one in found:
        if one.state is State.LEFT and remove(one.path, one.lock):
            if one.path.exists():
                raise AirgroundError(f"{one.path}: cannot be removed; its rights do not allow it")
            removed.append(one)
    return removed


def finding(found: list[Leftover]) -> Finding:
    """What `doctor` says about leftovers."""
    left = [one for one in found if one.state is State.LEFT]
    if not left:
        return Finding("leftovers", Health.FINE, "none here and among temporary files")
    size = mebibytes(sum(one.size_bytes for one in left))
    detail = f"{len(left)} here and among temporary files, {size}"
    return Finding("leftovers", Health.POOR, detail, "airground doctor --clean removes them")


def print_leftovers(found: list[Leftover], removed: list[Leftover]) -> None:
    """Print a line for each leftover, and the sum of what was removed."""
    for one in found:
        what = "removed" if one in removed else f"kept, {one.state.value}"
        print(f"{one.path}  {mebibytes(one.size_bytes)}  {what}")
    size = mebibytes(sum(one.size_bytes for one in removed))
    print(f"{len(removed)} of {len(found)} removed, {size}" if found else "nothing is left over")


def _in_folder(folder: Path) -> Iterator[Leftover]:
    yield from (_one(path) for path in named(folder, PARTIAL))
    yield from _in_results(folder)
    for path in named(folder, UNFINISHED):
        if _is_dataset(path):
            state = State.USED if is_held(path) else State.CONTINUED
            yield Leftover(path, path, size_bytes(path), state)
            for part in (path, *_folders(path)):
                yield from (_one(one) for one in named(part, PARTIAL))
    for path in _folders(folder):
        yield from _in_results(path)


def _is_dataset(folder: Path) -> bool:
    """Whether a folder is an unfinished dataset: with a plan, or with recordings without truth."""
    return any((folder / name).is_file() for name in (PLAN, BENCHMARK)) or any(
        (one / HEADER).is_file() for one in _folders(folder)
    )


def _in_results(folder: Path) -> Iterator[Leftover]:
    """What is unfinished in a folder of `reproduce` or `sweep`; nothing in others."""
    lock = folder / LOCK
    if not _is_results(folder):
        return
    for path in (folder / SCRATCH, folder / RESULTS):
        if path.is_dir() and not path.is_symlink():
            state = State.USED if is_held(lock) else State.LEFT
            yield Leftover(path, lock, size_bytes(path), state)
    for place in (folder / UNITS, folder / RECORDINGS):
        yield from (_one(path) for path in named(place, PARTIAL))


def _is_results(folder: Path) -> bool:
    """Whether a folder has the lock of results, and in `units/` nothing but units."""
    if not (folder / LOCK).is_file() or not (folder / UNITS).is_dir():
        return False
    units = [path for path in _folders(folder / UNITS) if not path.name.startswith(".")]
    return all((unit / MADE_FROM).is_file() for unit in units)


def _is_mine(path: Path) -> bool:
    with suppress(OSError):
        return path.lstat().st_uid == os.geteuid()
    return False


def _one(path: Path) -> Leftover:
    """A file or folder with a lock of its own."""
    return Leftover(path, path, size_bytes(path), State.USED if is_held(path) else State.LEFT)


def _folders(folder: Path) -> list[Path]:
    """Folders in a folder, without links; none if it cannot be read."""
    with suppress(OSError):
        return sorted(p for p in folder.iterdir() if p.is_dir() and not p.is_symlink())
    return []

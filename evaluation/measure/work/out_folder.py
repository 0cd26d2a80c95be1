"""A folder of results in which a run continues an earlier one."""

from __future__ import annotations

import fcntl
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from airground.core.leftovers import log_removed, remove_left, size_bytes
from airground.errors import InputError
from evaluation.measure.work.unit import UnitStore
from sim.partial_folder import PARTIAL

UNITS, RECORDINGS = "units", "recordings"
SCRATCH, RESULTS, LOCK = ".scratch", ".results", ".lock"


@dataclass(frozen=True)
class OutFolder:
    """Folders of a run.

    Attributes:
        path: The folder itself.
        store: The finished units.
        scratch: Folder of temporary files.
        results: Folder of results, which move to `path` when all are complete.
        recordings: Folder of recordings made by this run; it may not exist.
    """

    path: Path
    store: UnitStore
    scratch: Path
    results: Path
    recordings: Path


@contextmanager
def resumable_folder(path: Path) -> Iterator[OutFolder]:
    """A new folder, or one that an earlier run left, complete or not.

    When the block ends without an error, the files in `results` replace those of the same names in
    `path`. Otherwise only finished units stay; a new folder without any is removed.

    Raises:
        InputError: `path` is of another kind, cannot be created, or is in use by another run.
        OSError: Writing failed; the error names a file.
    """
    new = not path.exists()
    if not new and not _is_ours(path):
        raise InputError(
            f"--out {path}: exists already and holds no {UNITS}/ to go on with; name a new folder"
        )
    try:
        path.mkdir(parents=True, exist_ok=True)
        lock = (path / LOCK).open("w", encoding="utf-8")
    except OSError as error:
        raise InputError(f"--out {path}: cannot create it ({error.strerror})") from error
    with lock:
        _take(lock.fileno(), path)
        scratch, results, recordings = path / SCRATCH, path / RESULTS, path / RECORDINGS
        try:
            _remove_left(path)
            scratch.mkdir()
            results.mkdir()
            yield OutFolder(path, UnitStore(path / UNITS), scratch, results, recordings)
            for made in sorted(results.iterdir()):
                _replace(made, path / made.name)
        except OSError as error:
            # An error while writing, as on a full disk, does not name the file.
            if error.errno is not None and error.filename is None:
                raise OSError(error.errno, error.strerror, str(path)) from error
            raise
        finally:
            for folder in (scratch, results):
                shutil.rmtree(folder, ignore_errors=True)
            if new:
                _remove_if_unused(path)


def _remove_left(path: Path) -> None:
    """Remove what a killed run left in a folder whose lock is held."""
    left = [folder for folder in (path / SCRATCH, path / RESULTS) if folder.is_dir()]
    size = sum(map(size_bytes, left))
    for folder in left:
        shutil.rmtree(folder, ignore_errors=True)
    log_removed(left, size)
    remove_left(path / RECORDINGS, PARTIAL)


def _is_ours(path: Path) -> bool:
    """Whether a run left this folder: with its units, or with what it made before them, as where
    the folder vanished meanwhile."""
    if (path / UNITS).is_dir():
        return True
    left = {file.name for file in path.iterdir()} if path.is_dir() else set()
    return bool(left) and left <= {LOCK, RECORDINGS, SCRATCH, RESULTS}


def _take(descriptor: int, path: Path) -> None:
    """Lock the folder; the system releases the lock when this process ends."""
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        raise InputError(f"--out {path}: another run is writing there") from None


def _replace(made: Path, place: Path) -> None:
    if place.is_dir():
        shutil.rmtree(place)
    made.replace(place)


def _remove_if_unused(path: Path) -> None:
    """Remove a folder without finished units, if it did not vanish."""
    if not path.is_dir():
        return
    left = {file.name for file in path.iterdir()}
    if left <= {LOCK, UNITS} and not any((path / UNITS).glob("*")):
        shutil.rmtree(path)

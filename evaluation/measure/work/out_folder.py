"""A folder of results that a run can go on with where an earlier one stopped."""

from __future__ import annotations

import fcntl
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from airground.errors import InputError
from evaluation.measure.work.unit import UnitStore

UNITS, RECORDINGS = "units", "recordings"
SCRATCH, RESULTS, LOCK = ".scratch", ".results", ".lock"


@dataclass(frozen=True)
class OutFolder:
    """Where a run keeps its things.

    Attributes:
        path: The folder itself.
        store: Its finished units.
        scratch: For what lives no longer than the run.
        results: Results are written here, and moved to `path` once all are whole.
        recordings: For those of this run alone; it need not be there.
    """

    path: Path
    store: UnitStore
    scratch: Path
    results: Path
    recordings: Path


@contextmanager
def resumable_folder(path: Path) -> Iterator[OutFolder]:
    """A new folder, or one that an earlier run of this kind left, whatever ended that run.

    When the block ends without an error, what is in `results` replaces what `path` had of the
    same names. Otherwise only finished units stay, and no folder where there are none.

    Raises:
        InputError: `path` is something else, cannot be made, or another run is using it.
        OSError: Writing failed; the error names a file.
    """
    new = not path.exists()
    if not new and not (path / UNITS).is_dir():
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
            # What a killed run has left behind.
            for folder in (scratch, results, *recordings.glob(".*.partial")):
                shutil.rmtree(folder, ignore_errors=True)
            scratch.mkdir()
            results.mkdir()
            yield OutFolder(path, UnitStore(path / UNITS), scratch, results, recordings)
            for made in sorted(results.iterdir()):
                _replace(made, path / made.name)
        except OSError as error:
            # A full disk is noticed while writing, when nobody remembers which file it was.
            if error.errno is not None and error.filename is None:
                raise OSError(error.errno, error.strerror, str(path)) from error
            raise
        finally:
            for folder in (scratch, results):
                shutil.rmtree(folder, ignore_errors=True)
            if new:
                _remove_if_unused(path)


def _take(descriptor: int, path: Path) -> None:
    """The system lets go of the lock when this process ends, however it does."""
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        raise InputError(f"--out {path}: another run is writing there") from None


def _replace(made: Path, place: Path) -> None:
    if place.is_dir():
        shutil.rmtree(place)
    made.replace(place)


def _remove_if_unused(path: Path) -> None:
    """Leave no folder behind in which nothing was finished."""
    left = {file.name for file in path.iterdir()}
    if left <= {LOCK, UNITS} and not any((path / UNITS).glob("*")):
        shutil.rmtree(path)

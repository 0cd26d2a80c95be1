"""Output folders that are whole or not there at all, whatever ends the process that writes them."""

from __future__ import annotations

import contextlib
import fcntl
import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

SUFFIX = ".partial"


@contextmanager
def partial_folder(path: Path) -> Iterator[Path]:
    """A hidden folder beside `path`, to be renamed to it when all is written.

    It is removed with the block unless it was renamed. A process that was killed leaves its own:
    the next one that writes the same `path` removes it. A lock tells whether its process lives.

    Raises:
        OSError: No folder can be made there.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    _remove_abandoned(path)
    folder = Path(tempfile.mkdtemp(prefix=f".{path.name}.", dir=path.parent))
    folder.chmod(0o777 & ~_umask())
    with _locked(folder):
        # Locked before it has the name by which others look for abandoned ones.
        named = folder.rename(folder.with_name(folder.name + SUFFIX))
        try:
            yield named
        finally:
            shutil.rmtree(named, ignore_errors=True)


def _remove_abandoned(path: Path) -> None:
    for folder in path.parent.glob(f".{_escaped(path.name)}.*{SUFFIX}"):
        with contextlib.suppress(OSError), _locked(folder):
            shutil.rmtree(folder, ignore_errors=True)


def _escaped(name: str) -> str:
    """A name in which `glob` sees no pattern."""
    return "".join(f"[{letter}]" if letter in "*?[" else letter for letter in name)


@contextmanager
def _locked(folder: Path) -> Iterator[None]:
    """Hold a folder's lock, which ends with the process; OSError if another process has it."""
    descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        yield
    finally:
        os.close(descriptor)


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask

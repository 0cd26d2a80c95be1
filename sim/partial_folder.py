"""Output folders that are whole or not there at all, whatever ends the process that writes them."""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from airground.core.scratch_folder import locked, remove_abandoned

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
    remove_abandoned(path.parent, f".{_escaped(path.name)}.*{SUFFIX}")
    folder = Path(tempfile.mkdtemp(prefix=f".{path.name}.", dir=path.parent))
    folder.chmod(0o777 & ~_umask())
    with locked(folder):
        # Locked before it has the name by which others look for abandoned ones.
        named = folder.rename(folder.with_name(folder.name + SUFFIX))
        try:
            yield named
        finally:
            shutil.rmtree(named, ignore_errors=True)


def _escaped(name: str) -> str:
    """A name in which `glob` sees no pattern."""
    return "".join(f"[{letter}]" if letter in "*?[" else letter for letter in name)


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask

"""Output folders and files that are whole or not there at all, whatever ends the process that
writes them."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from airground.core.leftovers import RANDOM, is_held, named, new_locked, remove_left

MARK = ".partial-"
PARTIAL = rf"\.(?P<name>.+){re.escape(MARK)}{RANDOM}"
"""Regular expression for the names of unfinished folders and files."""


@contextmanager
def partial_folder(path: Path) -> Iterator[Path]:
    """A hidden folder beside `path`, to be renamed to it when all is written.

    It is removed with the block unless it was renamed. A process that was killed leaves its own:
    the next one that writes the same `path` removes it, and logs that.

    Raises:
        OSError: No folder can be made there.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    remove_left(path.parent, _partial(path))
    with new_locked(path.parent, f".{path.name}{MARK}", folder=True) as folder:
        folder.chmod(0o777 & ~_umask())
        yield folder


@contextmanager
def whole_file(path: Path) -> Iterator[Path]:
    """A hidden empty file beside `path`, which replaces it when the block ends without an error.

    What killed processes leave is removed as by `partial_folder`.

    Raises:
        OSError: No file can be made there.
    """
    remove_left(path.parent, _partial(path))
    with new_locked(path.parent, f".{path.name}{MARK}", folder=False) as file:
        file.chmod(0o666 & ~_umask())
        yield file
        file.replace(path)


def is_being_written(path: Path) -> bool:
    """Whether a live process has an unfinished folder or file for `path`."""
    return any(is_held(one) for one in named(path.parent, _partial(path)))


def _partial(path: Path) -> str:
    """Regular expression for the names of what is unfinished of `path`."""
    return rf"\.{re.escape(path.name)}{re.escape(MARK)}{RANDOM}"


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask

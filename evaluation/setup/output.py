"""Output folders that are whole or not there at all."""

from __future__ import annotations

import errno
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

from airground.core.leftovers import locked, remove_left
from airground.errors import InputError
from sim.partial_folder import PARTIAL, is_being_written, partial_folder, whole_file


@contextmanager
def fresh_folder(path: Path) -> Iterator[Path]:
    """A folder to write to, which becomes `path` when the block ends without an error.

    Until then it has a temporary name beside `path`; an error or Ctrl-C removes it, and after a
    SIGKILL the next one with that `path`.

    Raises:
        InputError: `path` exists already, another process is writing it, or its parent cannot hold
            a folder.
        OSError: Writing failed; the error names a file.
    """
    check_free(path)
    with ExitStack() as stack:
        try:
            partial = stack.enter_context(partial_folder(path))
        except OSError as error:
            raise InputError(f"--out {path}: cannot create it ({error.strerror})") from error
        try:
            yield partial
            _take_place(partial, path)
        except OSError as error:
            # A full disk is noticed while writing, where the error does not name the file.
            if error.errno is not None and error.filename is None:
                raise OSError(error.errno, error.strerror, str(path)) from error
            raise


@contextmanager
def continued_folder(path: Path) -> Iterator[None]:
    """Make an unfinished folder, or go on in the one that an earlier run left, and keep other
    processes from it during the block; it stays, and may be renamed.

    Raises:
        InputError: Another process works in it.
        OSError: It cannot be made.
    """
    path.mkdir(parents=True, exist_ok=True)
    with ExitStack() as stack:
        try:
            stack.enter_context(locked(path))
        except (BlockingIOError, FileNotFoundError):
            raise InputError(f"{path}: another process works on it") from None
        for folder in (path, *path.glob("*/")):
            remove_left(folder, PARTIAL)
        yield


def check_free(path: Path) -> None:
    """Refuse an output folder that exists or is being written, before any work is done.

    Raises:
        InputError: `path` exists, or a live process has an unfinished folder for it.
    """
    _check_absent(path)
    if is_being_written(path):
        raise InputError(f"--out {path}: another run is writing it; name another folder")


def _check_absent(path: Path) -> None:
    if path.exists() or path.is_symlink():
        raise InputError(f"--out {path}: exists already; name a new folder, or remove this one")


def _take_place(partial: Path, path: Path) -> None:
    """Give a finished folder its name; InputError if another process was faster."""
    _check_absent(path)
    try:
        partial.rename(path)
    except OSError as error:
        if error.errno in (errno.ENOTEMPTY, errno.EEXIST):
            _check_absent(path)
        raise


def check_new_file(path: Path, option: str) -> None:
    """Refuse an output file that exists or has no folder, before any work is done.

    Raises:
        InputError: `path`, which the option names, cannot become a new file.
    """
    if path.exists() or path.is_symlink():
        raise InputError(f"{option} {path}: exists already; name a new file, or remove this one")
    if not path.parent.is_dir():
        raise InputError(f"{option} {path}: there is no folder {path.parent}")


def write_whole(path: Path, text: str) -> None:
    """Write a file, or replace it: whole, or not at all.

    Raises:
        OSError: Writing failed; the error names a file.
    """
    try:
        with whole_file(path) as partial:
            partial.write_text(text, encoding="utf-8")
    except OSError as error:
        # The name of the unfinished file says nothing to its user.
        raise OSError(error.errno, error.strerror, str(path)) from error

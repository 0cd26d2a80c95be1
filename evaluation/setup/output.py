"""Output folders that are whole or not there at all."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

from airground.errors import InputError
from sim.partial_folder import partial_folder


@contextmanager
def fresh_folder(path: Path) -> Iterator[Path]:
    """A folder to write to, which becomes `path` when the block ends without an error.

    Until then it has a temporary name beside `path`; an error or Ctrl-C removes it, and after a
    SIGKILL the next one with that `path`.

    Raises:
        InputError: `path` exists already, or its parent cannot hold a folder.
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
            check_free(path)
            partial.rename(path)
        except OSError as error:
            # A full disk is noticed while writing, where the error does not name the file.
            if error.errno is not None and error.filename is None:
                raise OSError(error.errno, error.strerror, str(path)) from error
            raise


def check_free(path: Path) -> None:
    """Refuse an output folder that exists, before any work is done.

    Raises:
        InputError: `path` exists.
    """
    if path.exists() or path.is_symlink():
        raise InputError(f"--out {path}: exists already; name a new folder, or remove this one")


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
    """Write a new file: whole, or not at all.

    Raises:
        OSError: Writing failed; the error names a file.
    """
    partial = path.with_name(f".{path.name}.partial")
    try:
        partial.write_text(text, encoding="utf-8")
        partial.rename(path)
    finally:
        partial.unlink(missing_ok=True)

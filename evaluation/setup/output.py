"""Output folders that are whole or not there at all."""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from airground.errors import InputError


@contextmanager
def fresh_folder(path: Path) -> Iterator[Path]:
    """A folder to write to, which becomes `path` when the block ends without an error.

    Until then it has a temporary name beside `path`; an error or Ctrl-C removes it.

    Raises:
        InputError: `path` exists already, or its parent cannot hold a folder.
        OSError: Writing failed; the error names a file.
    """
    check_free(path)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        partial = Path(tempfile.mkdtemp(prefix=f".{path.name}.partial-", dir=path.parent))
    except OSError as error:
        raise InputError(f"--out {path}: cannot create it ({error.strerror})") from error
    try:
        yield partial
        partial.chmod(0o777 & ~_umask())
        check_free(path)
        partial.rename(path)
    except OSError as error:
        # A full disk is noticed while writing, where the error does not name the file.
        if error.errno is not None and error.filename is None:
            raise OSError(error.errno, error.strerror, str(path)) from error
        raise
    finally:
        shutil.rmtree(partial, ignore_errors=True)


def check_free(path: Path) -> None:
    """Refuse an output folder that exists, before any work is done.

    Raises:
        InputError: `path` exists.
    """
    if path.exists() or path.is_symlink():
        raise InputError(f"--out {path}: exists already; name a new folder, or remove this one")


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask

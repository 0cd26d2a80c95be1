"""Unfinished files and folders, each locked as long as its process lives; without a lock, it was
left by a process that was killed.

The system frees a lock with its process. Locks hold between processes of one machine: a network's
file system may not carry them to another.
"""

from __future__ import annotations

import errno
import fcntl
import logging
import os
import re
import shutil
import stat
import tempfile
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

RANDOM = "[a-z0-9_]{8}"
"""What `tempfile` appends to a name."""

logger = logging.getLogger(__name__)


@contextmanager
def locked(path: Path) -> Iterator[None]:
    """Hold the lock of a file or folder, which is no link.

    Raises:
        BlockingIOError: Another process has it.
        OSError: The path cannot be opened, or has vanished.
    """
    descriptor = os.open(path, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK)
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        if not os.path.samestat(os.fstat(descriptor), path.lstat()):
            raise FileNotFoundError(errno.ENOENT, os.strerror(errno.ENOENT), str(path))
        yield
    finally:
        os.close(descriptor)


@contextmanager
def new_locked(parent: Path, prefix: str, *, folder: bool) -> Iterator[Path]:
    """A new file or folder of mode 0700 or 0600, locked and removed with the block.

    It keeps its lock if it is renamed, and stays then.

    Args:
        parent: Folder in which it is made.
        prefix: Start of its name, which ends in 8 random characters.
        folder: Whether it is a folder.

    Raises:
        OSError: It cannot be made there.
    """
    with ExitStack() as stack:
        path = None
        while path is None:
            path = _locked_new(parent, prefix, folder, stack)
        stack.callback(_remove, path)
        yield path


def remove_left(parent: Path, pattern: str) -> list[Path]:
    """Remove files and folders whose process has ended, and log which.

    Args:
        parent: Folder that holds them; it may be missing.
        pattern: Regular expression for the whole name.
    """
    removed, size = [], 0
    for path in named(parent, pattern):
        bytes_of_it = size_bytes(path)
        if remove(path, path):
            removed.append(path)
            size += bytes_of_it
    log_removed(removed, size)
    return removed


def remove(path: Path, lock: Path) -> bool:
    """Remove a file or folder as far as rights allow it, while its lock is held; False if a live
    process holds the lock, or the lock is missing."""
    with suppress(OSError), locked(lock):
        _remove(path)
        return True
    return False


def log_removed(paths: list[Path], size: int) -> None:
    """Log one line for what was removed, if anything was; `size` in bytes."""
    if paths:
        names = ", ".join(map(str, paths))
        logger.info("removed what a killed process left: %s (%s)", names, mebibytes(size))


def named(parent: Path, pattern: str) -> list[Path]:
    """Files and folders, no links, whose whole names match a regular expression; in order."""
    whole = re.compile(pattern, re.DOTALL)
    try:
        with os.scandir(parent) as entries:
            found = [
                Path(one.path)
                for one in entries
                if whole.fullmatch(one.name)
                and (one.is_dir(follow_symlinks=False) or one.is_file(follow_symlinks=False))
            ]
    except OSError:
        return []
    return sorted(found)


def is_held(path: Path) -> bool:
    """Whether a live process has the lock of a file or folder."""
    try:
        with locked(path):
            return False
    except BlockingIOError:
        return True
    except OSError:
        return False


def size_bytes(path: Path) -> int:
    """Size of a file, or of all files in a folder [bytes]; links count with their own."""
    size = 0
    with suppress(OSError):
        status = path.lstat()
        if not stat.S_ISDIR(status.st_mode):
            return status.st_size
        for folder, _, files in os.walk(path):
            for file in files:
                with suppress(OSError):
                    size += os.lstat(os.path.join(folder, file)).st_size
    return size


def mebibytes(size: int) -> str:
    """A size in bytes, in words."""
    return f"{size / 2**20:.1f} MiB"


def _locked_new(parent: Path, prefix: str, folder: bool, stack: ExitStack) -> Path | None:
    """A new file or folder whose lock the stack releases; None if another process took it for left
    over before it was locked."""
    path = _new(parent, prefix, folder)
    try:
        stack.enter_context(locked(path))
    except (FileNotFoundError, BlockingIOError):
        _remove(path)
        return None
    except OSError:
        _remove(path)
        raise
    return path


def _new(parent: Path, prefix: str, folder: bool) -> Path:
    if folder:
        return Path(tempfile.mkdtemp(prefix=prefix, dir=parent))
    descriptor, name = tempfile.mkstemp(prefix=prefix, dir=parent)
    os.close(descriptor)
    return Path(name)


def _remove(path: Path) -> None:
    with suppress(OSError):
        if path.is_dir() and not path.is_symlink():
            shutil.rmtree(path, ignore_errors=True)
        else:
            path.unlink()

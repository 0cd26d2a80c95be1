"""One process compiles, the others load what it has stored.

Numba stores compiled kernels beside their sources. Without them, on the first run and after a
change, processes that start together would each compile the same kernels: a minute of processor
time per process.
"""

from __future__ import annotations

import fcntl
import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from numba.core import event


@contextmanager
def compiling_once(group: str) -> Iterator[None]:
    """From its first kernel that has to be compiled to the end of the block, this process holds the
    lock of the group.

    Another process in a block of the same group waits at its own first such kernel, compiles that
    one again, and loads the others. Where all kernels are stored, no process waits.

    Args:
        group: Name of the kernels that the block compiles; part of a file name.
    """
    waiter = _LockAtFirst(Path(tempfile.gettempdir()) / f"airground-{os.getuid()}-{group}.lock")
    try:
        with event.install_listener("numba:compile", waiter):
            yield
    finally:
        waiter.release()


class _LockAtFirst(event.Listener):
    """Takes the lock when numba compiles for the first time; the system frees it if the process
    dies. The file stays: another process may be waiting for it."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._file: int | None = None

    def on_start(self, event: Any) -> None:
        if self._file is None:
            with suppress(OSError):  # a folder that cannot be written: without the lock
                self._file = os.open(self._path, os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW, 0o600)
                fcntl.flock(self._file, fcntl.LOCK_EX)

    def on_end(self, event: Any) -> None:
        pass

    def release(self) -> None:
        if self._file is not None:
            os.close(self._file)
            self._file = None

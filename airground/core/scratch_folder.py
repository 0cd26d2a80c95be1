"""Folders for temporary files, gone with their process even where that was killed."""

from __future__ import annotations

import contextlib
import fcntl
import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import AbstractContextManager, ExitStack, contextmanager
from pathlib import Path

PREFIX = "airground-scratch-"


class ScratchFolder(AbstractContextManager["ScratchFolder"]):
    """A new folder of mode 0700 for temporary files, removed when it is closed.

    A process that was killed leaves its own; the next one that makes such a folder in the same
    place removes it. A lock, which the system frees with the process, tells whether it lives.

    Args:
        parent: Where; the folder of temporary files of the system if None.

    Attributes:
        path: The folder.

    Raises:
        OSError: No folder can be made there.
    """

    def __init__(self, parent: Path | None = None) -> None:
        parent = Path(tempfile.gettempdir()) if parent is None else parent
        remove_abandoned(parent, f"{PREFIX}*")
        with ExitStack() as stack:
            # Locked before it has the name by which others look for abandoned ones.
            made = Path(tempfile.mkdtemp(prefix=f".{PREFIX}", dir=parent))
            stack.callback(shutil.rmtree, made, ignore_errors=True)
            stack.enter_context(locked(made))
            self.path = made.rename(made.with_name(made.name.removeprefix(".")))
            stack.callback(shutil.rmtree, self.path, ignore_errors=True)
            self._stack = stack.pop_all()

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Remove the folder; a second time this does nothing."""
        self._stack.close()


def remove_abandoned(parent: Path, pattern: str) -> None:
    """Remove the folders in `parent` whose names match, and whose processes have ended."""
    for folder in parent.glob(pattern):
        with contextlib.suppress(OSError), locked(folder):
            shutil.rmtree(folder, ignore_errors=True)


@contextmanager
def locked(folder: Path) -> Iterator[None]:
    """Hold a folder's lock, which ends with the process; OSError if another process has it."""
    descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW)
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        yield
    finally:
        os.close(descriptor)

"""Folders for temporary files, gone with their process even where that was killed."""

from __future__ import annotations

import tempfile
from contextlib import AbstractContextManager, ExitStack
from pathlib import Path

from airground.core.leftovers import RANDOM, new_locked, remove_left

PREFIX = "airground-scratch-"
SCRATCH_FOLDERS = f"{PREFIX}{RANDOM}"
"""Regular expression for their names."""


class ScratchFolder(AbstractContextManager["ScratchFolder"]):
    """A new folder of mode 0700 for temporary files, removed when it is closed.

    A process that was killed leaves its own; the next one that makes such a folder in the same
    place removes it.

    Args:
        parent: Where; the folder of temporary files of the system if None.

    Attributes:
        path: The folder.

    Raises:
        OSError: No folder can be made there.
    """

    def __init__(self, parent: Path | None = None) -> None:
        parent = Path(tempfile.gettempdir()) if parent is None else parent
        remove_left(parent, SCRATCH_FOLDERS)
        with ExitStack() as stack:
            self.path = stack.enter_context(new_locked(parent, PREFIX, folder=True))
            self._stack = stack.pop_all()

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Remove the folder; a second time this does nothing."""
        self._stack.close()

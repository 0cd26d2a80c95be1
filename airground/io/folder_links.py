"""Links in a recording's folder: those that lead out of it are refused.

A folder of a stranger could otherwise name any file that its reader may read, such as the truth of
a benchmark or a private key, and an export would copy it.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

from airground.errors import InputError, RecordingError

FOLLOW_LINKS = "AIRGROUND_FOLLOW_LINKS"
"""Environment variable, so that worker processes have it too; 1 allows links to anywhere."""


def check_links(folder: Path) -> None:
    """Check every link below a folder, once when it is opened: 0.5 s for a million files.

    Args:
        folder: Folder, or a link to one.

    Raises:
        RecordingError: A link leads out of the folder, or a folder in it cannot be listed.
        InputError: `AIRGROUND_FOLLOW_LINKS` is neither 0 nor 1.
    """
    if _follows_links():
        return
    root = os.path.realpath(folder)
    for link in _links(root):
        target = os.path.realpath(link)
        if not Path(target).is_relative_to(root):
            raise RecordingError(
                f"{folder / os.path.relpath(link, root)}: is a link to {target}, which lies "
                f"outside of {folder}; expected files of the folder ({FOLLOW_LINKS}=1 allows links "
                "to anywhere)"
            )


def _follows_links() -> bool:
    value = os.environ.get(FOLLOW_LINKS, "")
    if value not in ("", "0", "1"):
        raise InputError(f"{FOLLOW_LINKS}: expected 1 or 0, got '{value}'")
    return value == "1"


def _links(root: str) -> Iterator[str]:
    """All links below a folder; those that it leads through are not entered."""
    waiting = [root]
    while waiting:
        folder = waiting.pop()
        try:
            with os.scandir(folder) as entries:
                for entry in entries:
                    if entry.is_symlink():
                        yield entry.path
                    elif entry.is_dir(follow_symlinks=False):
                        waiting.append(entry.path)
        except PermissionError:
            if os.access(folder, os.X_OK):  # its files can be opened by name, and links with them
                raise RecordingError(f"{folder}: cannot be listed: permission denied") from None
        except (FileNotFoundError, NotADirectoryError):
            continue  # whoever reads it says so

"""Files that a list names: a list that somebody else wrote must not lead elsewhere."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path, PurePosixPath

from airground.errors import RecordingError


def listed_files(folder: Path, names: Iterable[str], list_path: Path) -> list[Path]:
    """Where the files of these names are.

    Args:
        folder: What the names are relative to.
        names: As they stand in the list.
        list_path: The list, for the message.

    Raises:
        RecordingError: A name leads out of the folder.
    """
    files = []
    for name in names:
        path = PurePosixPath(name)
        if path.is_absolute() or ".." in path.parts or "\0" in name:
            raise RecordingError(
                f"{list_path}: the file name {name[:60]!r} leads out of the recording; expected "
                "one below the folder, without '..'"
            )
        files.append(folder / path)
    return files

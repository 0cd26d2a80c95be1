"""Digests that tell whether the files of a recording are as they were written."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from pathlib import Path

from airground.io.input_files import TEXT_LIMIT, check_file


def bytes_digest(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()


def file_digest(path: Path) -> str:
    """Of a list of samples or an image, the largest files of a recording; raises OSError."""
    check_file(path, TEXT_LIMIT)
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def folder_digest(digests: Mapping[str, str]) -> str:
    """Digest of a folder from the digests of its files by name, independent of their order."""
    lines = "".join(f"{digests[name]}  {name}\n" for name in sorted(digests))
    return bytes_digest(lines.encode())


def path_digest(path: Path) -> str:
    """Digest of a file, or of a folder's files by name and contents."""
    if path.is_dir():
        return folder_digest({file.name: file_digest(file) for file in path.iterdir()})
    return file_digest(path)

"""Earlier versions of a file that git keeps."""

from __future__ import annotations

import subprocess
from pathlib import Path

GIT_TIMEOUT_S = 60.0
"""Reading hundreds of versions takes some seconds [s]."""


def earlier_texts(path: Path) -> list[str]:
    """The file's text after every commit that changed it, oldest first.
    Empty where git does not keep the file, or is not installed."""
    try:
        log = _git(path, "log", "--reverse", "--format=%H", "--", path.name)
        return [_git(path, "cat-file", "blob", f"{commit}:./{path.name}") for commit in log.split()]
    except (OSError, subprocess.SubprocessError, UnicodeDecodeError):
        return []


def _git(path: Path, *words: str) -> str:
    done = subprocess.run(
        ["git", "--no-pager", "-C", str(path.resolve().parent), *words],
        capture_output=True,
        check=True,
        timeout=GIT_TIMEOUT_S,
    )
    return done.stdout.decode("utf-8")

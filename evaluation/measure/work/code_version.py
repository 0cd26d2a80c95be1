"""Version of the code that makes results: a digest of its sources.

A stored result must never pass for one of other code. A git revision misses uncommitted changes,
and changes with the documentation. The digest covers all of `airground`, `sim` and `scenes`, and
of `evaluation` the imports of `evaluation.measure.work.experiment`, direct and indirect. A change
to a figure or a report leaves the version unchanged.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator
from functools import cache
from importlib import metadata
from pathlib import Path

from airground.io.digests import bytes_digest, file_digest, folder_digest

ROOT = Path(__file__).parents[3]
WHOLE_ROOMS = ("airground", "sim", "scenes")
MAKES_ROWS = "evaluation.measure.work.experiment"
LIBRARIES = (
    "kiss-matcher",
    "mujoco",
    "numba",
    "numpy",
    "open3d",
    "opencv-python-headless",
    "scikit-image",
    "scipy",
    "small-gicp",
)
"""Libraries that compute results: another version may round or sample differently."""


@cache
def code_version() -> str:
    """SHA-256 over the sources that make rows, and over the versions of the libraries."""
    sources = {str(file.relative_to(ROOT)): file_digest(file) for file in row_sources(ROOT)}
    libraries = {name: bytes_digest(_version(name).encode()) for name in LIBRARIES}
    return folder_digest(sources | libraries)


def row_sources(root: Path) -> list[Path]:
    """All files below `root` on which rows depend."""
    whole = [
        file
        for room in WHOLE_ROOMS
        for file in (root / room).rglob("*")
        if file.is_file() and file.suffix in (".py", ".toml")
    ]
    return sorted({*whole, *_imported_from(root, MAKES_ROWS)})


def _imported_from(root: Path, module: str) -> set[Path]:
    """The files of a module of `evaluation`, and of its direct and indirect imports there."""
    found: set[Path] = set()
    waiting = _files(root, module)
    while waiting:
        file = waiting.pop()
        if file not in found:
            found.add(file)
            for name in _imports(file):
                waiting += _files(root, name)
    return found


def _imports(file: Path) -> Iterator[str]:
    for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


def _files(root: Path, name: str) -> list[Path]:
    """Files that importing a dotted name of `evaluation` reads; none for other names."""
    parts = name.split(".")
    if parts[0] != "evaluation":
        return []
    paths = [root.joinpath(*parts[:count]) for count in range(1, len(parts) + 1)]
    files = [file for path in paths for file in (path / "__init__.py", path.with_suffix(".py"))]
    return [file for file in files if file.is_file()]


def _version(library: str) -> str:
    try:
        return metadata.version(library)
    except metadata.PackageNotFoundError:
        return "none"

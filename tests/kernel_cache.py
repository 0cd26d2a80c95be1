"""Keeps compiled kernels between runs of .ci/run, as long as nothing that they hold has changed.

`python -m tests.kernel_cache use FOLDER` before, `... keep FOLDER` after. Numba itself compiles a
kernel again after a change of its own file only, though it holds what it calls in other files
and their constants. Here kernels of a file serve until that file or one that it imports,
directly or not, or a library has changed.
"""

from __future__ import annotations

import hashlib
import shutil
import sys
from collections import defaultdict
from pathlib import Path

from tests.behind import LIBRARIES, digest, python_behind
from tests.sources import ROOMS, ROOT


def use(folder: Path, root: Path = ROOT) -> None:
    """Replace the compiled kernels of a tree by those kept of the same sources."""
    for kernels in compiled(root).values():
        for kernel in kernels:
            kernel.unlink()
    for source in (str(place.relative_to(folder)) for place in folder.rglob("*.py")):
        place = folder / source / key(source) if (ROOT / source).exists() else None
        if place is not None and place.exists():
            cache = (root / source).parent / "__pycache__"
            cache.mkdir(parents=True, exist_ok=True)
            for kernel in place.iterdir():
                shutil.copy2(kernel, cache)


def keep(folder: Path, root: Path = ROOT) -> None:
    """Keep the compiled kernels of a tree, and none of other sources."""
    new = folder.with_name(f"{folder.name}.new")
    shutil.rmtree(new, ignore_errors=True)
    new.mkdir(parents=True)
    for source, kernels in compiled(root).items():
        place = new / source / key(source)
        place.mkdir(parents=True)
        for kernel in kernels:
            shutil.copy2(kernel, place)
    shutil.rmtree(folder, ignore_errors=True)
    new.rename(folder)


def compiled(root: Path) -> dict[str, list[Path]]:
    """Numba's files in a tree, by the source that they were compiled from."""
    found = defaultdict(list)
    for room in ROOMS:
        for file in (root / room).rglob("__pycache__/*.nb[ic]"):
            source = file.parent.parent / f"{file.name.partition('.')[0]}.py"
            found[str(source.relative_to(root))].append(file)
    return {source: files for source, files in found.items() if (ROOT / source).exists()}


def key(source: str) -> str:
    """Names a source file with all that its kernels may hold."""
    found = hashlib.sha256(source.encode())
    for file in sorted({*python_behind(source), *LIBRARIES}):
        found.update(file.encode() + b"\0" + digest(file))
    return found.hexdigest()[:32]


if __name__ == "__main__":
    {"use": use, "keep": keep}[sys.argv[1]](Path(sys.argv[2]))

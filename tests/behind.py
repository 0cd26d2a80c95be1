"""Which files a test depends on, for what .ci/run keeps between runs.

By its imports, a test depends on the sources that its file reaches, on all data files, and on
the locked libraries. Where imports do not show what runs (another process, an import by name),
it depends on all sources. A subject (`pytest.mark.subject`) narrows that:

- `subject("evaluation/run", "airground/io")`: on these files, and those below these folders; on
  all that a program in tests/ imports;
- `subject(but={"airground/slam": "poses are exact"})`: on all but these, for the reason given.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Mapping
from functools import cache
from pathlib import Path

from tests.sources import ROOMS, ROOT, imports, sources

BY_NAME = {"importlib", "importlib.import_module", "pkgutil", "runpy"}
"""Imports with which a file can run code that it does not import."""
IN_TESTS = BY_NAME | {"subprocess"}
"""Likewise in tests, which start Python processes; other code starts only foreign programs."""
LAZY = "airground/__init__.py"
"""Imports what a name of the package stands for when that name is first used."""
LIBRARIES = ("pyproject.toml", "requirements.lock")


@cache
def digest(file: str) -> bytes:
    return hashlib.sha256((ROOT / file).read_bytes()).digest()


def files_behind(test_file: str) -> set[str]:
    """All that the tests of a file may depend on."""
    return {*python_behind(test_file), *data_files(), *pages_behind(test_file)}


def files_of_subject(test_file: str, named: tuple[str, ...], but: Mapping[str, str]) -> set[str]:
    """What a test with a subject depends on.

    Args:
        test_file: Path of the test's file, relative to the repository.
        named: Files, folders and programs of the subject; none for all that imports show.
        but: Files and folders left out, with the reason for each.
    """
    if not named:
        return {f for f in files_behind(test_file) if not any(is_in(f, path) for path in but)}
    found = {*helpers(*with_conftests(test_file)), *LIBRARIES}
    for path in named:
        if path.startswith("tests/"):
            found |= python_behind(path)
        elif (ROOT / path).is_dir():
            found |= set(files_below(path))
        else:
            found.add(path)
    return found


def is_in(file: str, path: str) -> bool:
    """Whether a file is the named one or lies below the named folder."""
    return file == path or file.startswith(f"{path}/")


def python_behind(file: str) -> set[str]:
    """A file, its conftests, and what they import; all sources where that is unknown."""
    waiting = with_conftests(file)
    found: set[str] = set()
    while waiting:
        file = waiting.pop()
        if file in found:
            continue
        found.add(file)
        names = () if file == LAZY else imports(file)
        hiding = IN_TESTS if file.startswith("tests/") else BY_NAME
        if any(
            name in hiding or name.partition(".")[0] in hiding - {"importlib"} for name in names
        ):
            return {*sources(*ROOMS, "tests"), *found}
        for name in names:
            modules = modules_of(name)
            waiting += modules
            if modules == [LAZY]:  # a name of the package, or the package for its names
                waiting += sources("airground")
    return found


def modules_of(name: str) -> list[str]:
    """Files of this project that an import of a dotted name runs, packages first."""
    parts = name.split(".")
    if parts[0] not in (*ROOMS, "tests"):
        return []
    paths = [Path(*parts[:count]) for count in range(1, len(parts) + 1)]
    modules = [str(p) for path in paths for p in (path / "__init__.py", f"{path}.py")]
    return [module for module in modules if (ROOT / module).is_file()]


def helpers(*test_files: str) -> set[str]:
    """Files, and those of tests/ that they import, directly or not."""
    waiting = list(test_files)
    found: set[str] = set()
    while waiting:
        file = waiting.pop()
        if file not in found:
            found.add(file)
            modules = [module for name in imports(file) for module in modules_of(name)]
            waiting += [module for module in modules if module.startswith("tests/")]
    return found


def with_conftests(file: str) -> list[str]:
    conftests = [str(folder / "conftest.py") for folder in Path(file).parents]
    above = [conftest for conftest in conftests if file.startswith("tests/")]
    return [file, *(conftest for conftest in above if (ROOT / conftest).exists())]


@cache
def files_below(folder: str) -> tuple[str, ...]:
    """All files below a folder but those that Python makes there."""
    files = (ROOT / folder).rglob("*.*")
    return tuple(
        str(file.relative_to(ROOT))
        for file in files
        if file.is_file() and file.parent.name != "__pycache__"
    )


@cache
def data_files() -> tuple[str, ...]:
    """Files other than Python that programs read, and the locked libraries."""
    files = [file for folder in (*ROOMS, "scenes", "tests") for file in files_below(folder)]
    return (*(file for file in files if not file.endswith(".py")), *LIBRARIES)


def pages_behind(test_file: str) -> list[str]:
    """The pages, for tests that run what they show."""
    text = (ROOT / test_file).read_text(encoding="utf-8")
    if not re.search("docs|README", text):
        return []
    return ["README.md", *(str(page.relative_to(ROOT)) for page in (ROOT / "docs").glob("*.md"))]

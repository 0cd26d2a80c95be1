"""A pytest plugin for .ci/run: slow tests that passed with the same sources do not run again.

`PASSED_BEFORE=FOLDER pytest -p tests.passed_before`. The folder has an empty file for each test
that passed, named by a digest of the test and of all it may depend on: the sources that its file
imports, directly or not, all data files, and the locked libraries. Where imports do not show what
runs (another process, an import by name), it depends on all sources.
"""

from __future__ import annotations

import hashlib
import os
import re
from collections.abc import Generator
from functools import cache
from pathlib import Path

import pytest

from tests.sources import ROOMS, ROOT, imports, sources

FOLDER = Path(os.environ["PASSED_BEFORE"])
MARKS = pytest.StashKey[dict[str, Path]]()
"""The file of each slow test that exists once the test has passed."""
BY_NAME = {"importlib", "importlib.import_module", "pkgutil", "runpy"}
"""Imports with which a file can run code that it does not import."""
IN_TESTS = BY_NAME | {"subprocess"}
"""Likewise in tests, which start Python processes; other code starts only foreign programs."""


def pytest_configure(config: pytest.Config) -> None:
    config.stash[MARKS] = {}


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    marks = config.stash[MARKS]
    marks.update((item.nodeid, mark(item)) for item in items if item.get_closest_marker("slow"))
    known = [item for item in items if item.nodeid in marks and marks[item.nodeid].exists()]
    if known:
        config.hook.pytest_deselected(items=known)
        items[:] = [item for item in items if item not in known]


def pytest_sessionfinish(session: pytest.Session, exitstatus: int) -> None:
    if exitstatus == pytest.ExitCode.NO_TESTS_COLLECTED:  # all passed before
        session.exitstatus = pytest.ExitCode.OK


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(
    item: pytest.Item, call: pytest.CallInfo[None]
) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    report = yield
    passed = item.config.stash[MARKS].get(item.nodeid)
    if passed is not None and call.when == "call" and report.passed:
        FOLDER.mkdir(parents=True, exist_ok=True)
        passed.touch()
    return report


def mark(item: pytest.Item) -> Path:
    """The file that says that a test passed with the present sources."""
    file = item.nodeid.partition("::")[0]
    subject = item.get_closest_marker("subject")
    files = files_behind(file) if subject is None else (file, *subject.args)
    found = hashlib.sha256(item.nodeid.encode())
    for file in files:
        found.update(file.encode() + b"\0" + digest(file))
    return FOLDER / found.hexdigest()


@cache
def files_behind(test_file: str) -> tuple[str, ...]:
    """All that the tests of a file may depend on."""
    files = {*python_behind(test_file), *data_files(), *pages_behind(test_file)}
    return tuple(sorted(files))


@cache
def digest(file: str) -> bytes:
    return hashlib.sha256((ROOT / file).read_bytes()).digest()


def python_behind(test_file: str) -> set[str]:
    """The test's file, its conftests, and what they import; all sources where that is unknown."""
    parents = [str(folder / "conftest.py") for folder in Path(test_file).parents]
    waiting = [test_file, *(file for file in parents if (ROOT / file).exists())]
    found: set[str] = set()
    while waiting:
        file = waiting.pop()
        if file in found:
            continue
        found.add(file)
        names = imports(file)
        hiding = IN_TESTS if file.startswith("tests/") else BY_NAME
        if any(
            name in hiding or name.partition(".")[0] in hiding - {"importlib"} for name in names
        ):
            return {*sources(*ROOMS, "tests"), *found}
        for name in names:
            parts = name.split(".")
            if parts[0] in (*ROOMS, "tests"):
                paths = [Path(*parts[:count]) for count in range(1, len(parts) + 1)]
                modules = [str(p) for path in paths for p in (path / "__init__.py", f"{path}.py")]
                waiting += [module for module in modules if (ROOT / module).is_file()]
    return found


@cache
def data_files() -> tuple[str, ...]:
    """Files other than Python that programs read, and the locked libraries."""
    files = [
        file for folder in (*ROOMS, "scenes", "tests") for file in (ROOT / folder).rglob("*.*")
    ]
    kept = [
        str(file.relative_to(ROOT))
        for file in files
        if file.is_file() and file.suffix != ".py" and file.parent.name != "__pycache__"
    ]
    return (*kept, "pyproject.toml", "requirements.lock")


def pages_behind(test_file: str) -> list[str]:
    """The pages, for tests that run what they show."""
    text = (ROOT / test_file).read_text(encoding="utf-8")
    if not re.search("docs|README", text):
        return []
    return ["README.md", *(str(page.relative_to(ROOT)) for page in (ROOT / "docs").glob("*.md"))]

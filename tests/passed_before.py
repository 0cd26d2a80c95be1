"""A pytest plugin for .ci/run: slow tests that passed with the same sources do not run again.

`PASSED_BEFORE=FOLDER pytest -p tests.passed_before`. The folder has an empty file for each test
that passed, named by a digest of the test and of all it depends on (`tests.behind`).
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Generator
from functools import cache
from pathlib import Path

import pytest

from tests.behind import digest, files_behind, files_of_subject

FOLDER = Path(os.environ["PASSED_BEFORE"])
MARKS = pytest.StashKey[dict[str, Path]]()
"""The file of each slow test that exists once the test has passed."""


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
    found = hashlib.sha256(item.nodeid.encode())
    for file in files(item):
        found.update(file.encode() + b"\0" + digest(file))
    return FOLDER / found.hexdigest()


def files(item: pytest.Item) -> tuple[str, ...]:
    """What a test depends on, in order."""
    test_file = item.nodeid.partition("::")[0]
    subject = item.get_closest_marker("subject")
    if subject is None:
        return _files_behind(test_file)
    but = subject.kwargs.get("but", {})
    return tuple(sorted(files_of_subject(test_file, subject.args, but)))


@cache
def _files_behind(test_file: str) -> tuple[str, ...]:
    return tuple(sorted(files_behind(test_file)))

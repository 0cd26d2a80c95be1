"""Set-up that every test shares.

Markers (declared in pyproject.toml):
    slow: takes more than a few seconds; `make test` leaves it out, .ci/run takes it in. With
        `minutes=`, about what it takes on two cores, its file starts before those of fewer.
    subject: what a slow test depends on, where that is less than its imports show
        (`tests.behind`).
    kernel: compares a compiled kernel with its slow twin. .ci/run repeats these with
        NUMBA_DISABLE_JIT=1, where coverage and debuggers see inside; so their data must be
        small enough to take under a second a test without the compiler.
"""

from __future__ import annotations

from pathlib import Path

import pytest

from evaluation.setup.environment import prepare

# Before any test module imports a library that reads it.
prepare()


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """The files that take longest first, so that the others run beside them."""
    minutes: dict[Path, float] = {}
    for item in items:
        slow = item.get_closest_marker("slow")
        asked = slow.kwargs.get("minutes", 0) if slow is not None else 0
        minutes[item.path] = max(asked, minutes.get(item.path, 0))
    items.sort(key=lambda item: -minutes[item.path])

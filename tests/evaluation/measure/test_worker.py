"""Threads of a worker, and its memory between tasks."""

from __future__ import annotations

from pathlib import Path

import pytest

from evaluation.measure.work import prepared_worker
from evaluation.measure.work.crew import Crew
from evaluation.measure.work.prepared_worker import PreparedWorker


def threads_of_kernels(_: int) -> int:
    import numba  # reads the environment when it is first imported

    return int(numba.config.NUMBA_NUM_THREADS)


def test_kernels_of_workers_share_the_cores(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("NUMBA_NUM_THREADS", "2")  # of the main process, inherited
    with Crew(None, 2, 2, tmp_path) as crew:
        assert dict(crew.outcomes(threads_of_kernels, [0, 1])) == {0: 1, 1: 1}


def test_free_memory_is_returned_when_a_task_ends(monkeypatch: pytest.MonkeyPatch) -> None:
    handed_back: list[bool] = []
    monkeypatch.setattr(prepared_worker, "hand_back_memory", lambda: handed_back.append(True))
    plugin = PreparedWorker(1)
    plugin.transition("task", "ready", "executing")
    assert not handed_back
    plugin.transition("task", "executing", "memory")
    assert handed_back == [True]

"""Memory of a worker between tasks."""

from __future__ import annotations

import pytest

from evaluation.measure.work import crew
from evaluation.measure.work.crew import PreparedWorker


def test_free_memory_is_returned_when_a_task_ends(monkeypatch: pytest.MonkeyPatch) -> None:
    handed_back: list[bool] = []
    monkeypatch.setattr(crew, "hand_back_memory", lambda: handed_back.append(True))
    plugin = PreparedWorker(1)
    plugin.transition("task", "ready", "executing")
    assert not handed_back
    plugin.transition("task", "executing", "memory")
    assert handed_back == [True]

"""What painting took of memory is handed back before images are drawn."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from sim.recording import recorder


def test_memory_goes_back_between_painting_and_drawing(monkeypatch: pytest.MonkeyPatch) -> None:
    order: list[str] = []
    plan: Any = SimpleNamespace(worlds={"mav": "one", "ground": "one"}, unlit=None)
    for name in ("painted", "_store_model", "hand_back_memory"):
        monkeypatch.setattr(recorder, name, lambda *_, name=name: order.append(name))
    monkeypatch.setattr(recorder, "with_exposure", lambda plan: order.append("drawn") or plan)
    world: Any = None
    assert recorder.with_models(plan, world) is plan
    assert order == ["painted", "_store_model", "hand_back_memory", "drawn"]

"""What is done before the clock of a run starts."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from evaluation.run import driver


def test_kernels_and_memory_are_ready_before_the_first_frame(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    order: list[str] = []

    def note(name: str, answer: Any = None) -> Any:
        return lambda *_: order.append(name) or answer

    monkeypatch.setattr(driver, "warm_up_mapping", note("kernels"))
    mapping = SimpleNamespace(reserve=note("memory"), correct_ground=note("corrected"))
    pipeline: Any = SimpleNamespace(mapping=mapping, run=list)
    report = SimpleNamespace(tracked={}, ground=None, peak_memory_mib=0.0, processor_s=0.0)
    tracking: Any = SimpleNamespace(
        wait_until_ready=note("robots"),
        frames=note("frames", iter(())),
        report=note("report", report),
    )
    recording: Any = SimpleNamespace(of=lambda _: SimpleNamespace(camera_stamps=()))
    setup: Any = SimpleNamespace(config=None)
    driver.drive(recording, tracking, pipeline, setup, [])
    assert order == ["kernels", "memory", "robots", "frames", "report", "corrected"]

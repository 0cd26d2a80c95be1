"""The example of docs/add_a_baseline.md does what the page says."""

from __future__ import annotations

import importlib.util
from dataclasses import replace
from pathlib import Path

from evaluation.measure.baselines.interface import Baseline
from tests.evaluation.measure.closed_worlds import boxes_on_floor, error_of, given_of

PAGE = Path(__file__).parents[3] / "docs" / "add_a_baseline.md"
MAX_LINES = 40


def test_the_example_locates_boxes(tmp_path: Path) -> None:
    example = PAGE.read_text(encoding="utf-8").split("```python\n")[1].partition("```")[0]
    assert len(example.splitlines()) < MAX_LINES
    file = tmp_path / "highest_heap.py"
    file.write_text(example, encoding="utf-8")
    spec = importlib.util.spec_from_file_location("highest_heap", file)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    baseline = Baseline("heap", "highest heap", "clouds, heading", module.highest_heap)

    given = given_of(boxes_on_floor())
    answer = baseline.locate(given)
    assert answer.claimed
    assert answer.T_ground_mav is not None
    assert error_of(answer.T_ground_mav, given)[0] < 0.01

    headless = replace(given, sighting=replace(given.sighting, heading=None))
    assert not baseline.locate(headless).claimed

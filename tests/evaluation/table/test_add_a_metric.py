"""The example of docs/add_a_metric.md does what the page says."""

from __future__ import annotations

import textwrap
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from airground.core.camera import PinholeCamera
from airground.core.se3 import SE3
from evaluation.judge import metrics
from evaluation.show.report import tables
from evaluation.table.row_writer import RowWriter
from evaluation.table.rows import ResultTable
from tests.evaluation.synthetic_results import BEST

PAGE = Path(__file__).parents[3] / "docs" / "add_a_metric.md"
CAMERA = PinholeCamera(6, 4, 5.0, 5.0, 2.5, 1.5)


class Plane:
    """A truth in which everything is 2 m away."""

    def surface(self, robot: str) -> Plane:
        return self

    def cast(self, camera: PinholeCamera, T_world_camera: SE3) -> NDArray[np.float32]:
        return np.full((camera.height, camera.width), 2.0, np.float32)


def test_the_example_is_measured_judged_and_shown(monkeypatch: pytest.MonkeyPatch) -> None:
    blocks = PAGE.read_text(encoding="utf-8").split("```python\n")[1:]
    measure, write, define, show = (
        textwrap.dedent(block.partition("   ```")[0]) for block in blocks
    )
    names: dict[str, Any] = {}
    exec(compile(measure, "measure", "exec"), names)
    out = RowWriter("tiny", 0, 0, BEST)
    far, unknown = np.full((4, 6), 2.003, np.float32), np.full((4, 6), np.nan, np.float32)
    far[0] = np.nan
    for index, depth in enumerate((far, far - np.float32(0.004), unknown)):
        surface = SimpleNamespace(depth=depth, camera=CAMERA)
        here = {"surface": surface, "T_world_camera": SE3.identity(), "truth": Plane()}
        exec(compile(write, "write", "exec"), {**names, **here, "out": out, "index": index})
    table = ResultTable.from_rows(out.rows)
    values = table.values("surface", "bias_m")
    assert values[:2] == pytest.approx([0.003, -0.001], abs=1e-6)
    assert np.isnan(values[2])

    metric = eval(define, dict(vars(metrics)))
    (of_flight,) = metric.samples(table).values()
    assert of_flight == pytest.approx([0.003, 0.001, np.inf], abs=1e-6)
    monkeypatch.setitem(metrics.METRICS, metric.name, metric)
    title, paper, cell = eval(show, dict(vars(tables)))
    assert (title, paper) == ("surface, bias", tables.MISSING)
    assert cell(table) == "3.0 mm"  # of three, one of them failed and counts as the largest

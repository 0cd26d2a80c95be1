"""The recipe of docs/look_into_a_run.md that reads one curve of many runs."""

from __future__ import annotations

import re
from pathlib import Path

import pandas as pd
import pytest

from tests.evaluation.show.scripted_run import BELIEF, written

PAGE = Path(__file__).parents[3] / "docs/look_into_a_run.md"


def test_one_curve_of_many_runs_is_a_table(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("a", "b"):
        (tmp_path / "results" / name).mkdir(parents=True)
        written(tmp_path / "results" / name / "run.rrd")
    monkeypatch.chdir(tmp_path)
    (recipe,) = (
        block
        for block in re.findall(r"```python\n(.*?)```", PAGE.read_text("utf-8"), re.DOTALL)
        if "def curve" in block
    )
    names: dict[str, object] = {}
    exec(compile(recipe, str(PAGE), "exec"), names)
    table = names["spread_m"]
    assert isinstance(table, pd.DataFrame)
    assert list(table.columns) == ["a", "b"]
    assert table.index.tolist() == [3.0]
    assert table.loc[3.0].tolist() == pytest.approx([BELIEF.spread_m] * 2)

"""`airground history`: its page, and what dashboards of others read."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import pytest

from evaluation import cli
from evaluation.judge.accepted import Measured
from evaluation.judge.history.series import History, history
from evaluation.judge.metrics import WATCHED
from evaluation.setup import console
from evaluation.show.history.dashboards import last_point, whole
from evaluation.show.history.figures import history_figure
from evaluation.show.history.page import conclusion
from evaluation.show.history.tables import revisions, steps_table, totals_table
from tests.evaluation.judge.flights import make_results, measured
from tests.evaluation.judge.test_history import point, written

SEEDS = range(12)
WORSE = {"error_median_m": 1.4}


@pytest.fixture(scope="module")
def found() -> History:
    runs = [measured(SEEDS), measured(SEEDS), measured(SEEDS, WORSE)]
    return history([point(f"revision{n}", run) for n, run in enumerate(runs)])


def test_the_tables_name_each_step(found: History) -> None:
    (row,) = steps_table(found).rows
    assert row[:2] == ("surface, median error", "worse")
    assert row[2].startswith("revision2")
    assert row[-1] == "12 flights, in pairs"
    totals = {row[0]: row for row in totals_table(found).rows}
    assert totals["surface, median error"][-1] == "1"
    assert totals["positions claimed"][3] == "none"
    assert [one.steps for one in revisions(found)] == ["worse: surface, median error", "", ""]
    assert conclusion(found) == "3 revisions; steps: 1 worse"


def test_a_figure_marks_the_step_between_its_points(found: History) -> None:
    (series,) = [one for one in found.series if one.steps]
    drawn = history_figure(series, found)
    (axes,) = drawn.figure.axes
    assert [line for line in axes.lines if list(line.get_xdata()) == [1.5, 1.5]]
    assert "Worse at revision2" in drawn.caption
    assert [text.get_text() for text in axes.get_xticklabels()] == ["revisio"] * 3


def test_the_last_point_is_what_github_action_benchmark_reads(found: History) -> None:
    smaller, bigger = (last_point(found, better) for better in ("lower", "higher"))
    assert len(smaller) + len(bigger) == len(WATCHED)
    for entry in [*smaller, *bigger]:
        assert set(entry) <= {"name", "unit", "value", "range", "extra"}
        assert isinstance(entry["value"], float)
        assert entry["unit"]
    names = {metric.title for metric in WATCHED if metric.better == "lower"}
    assert {entry["name"] for entry in smaller} == names


def test_a_failed_metric_is_left_out_of_what_needs_numbers() -> None:
    failed = history([point("one", measured(SEEDS, {"error_median_m": float("inf")}))])
    names = {entry["name"] for entry in last_point(failed, "lower")}
    assert "surface, median error" not in names
    assert whole(failed)["graphs"]["surface_median"] == [[0, None]]


def test_the_whole_history_has_the_form_of_asv(found: History) -> None:
    made: dict[str, Any] = json.loads(json.dumps(whole(found), allow_nan=False))
    assert made["revision_to_hash"] == {str(n): f"revision{n}" for n in range(3)}
    assert set(made["graphs"]) == set(made["benchmarks"]) == {metric.name for metric in WATCHED}
    (regression,) = made["regressions"]
    name, _, parameters, _, last, best, jumps = regression
    assert (name, parameters) == ("surface_median", {})
    assert last > best
    assert jumps[0][:2] == [1, 2]
    (step,) = made["steps"]
    assert step["low"] <= step["change"] <= step["high"]


def test_the_command_writes_a_page_that_needs_nothing_else(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("evaluation.judge.history.series.WATCHED", WATCHED[:6])
    for name, factors in (("a$<b>", None), ("c", WORSE)):
        written(make_results(SEEDS, factors), tmp_path / "runs" / name)
    words = ["history", str(tmp_path / "runs"), "--out", str(tmp_path / "out")]
    with pytest.raises(SystemExit) as exit_:
        cli.main(words)
    assert exit_.value.code == console.EXIT_OK
    assert "2 revisions; steps: 1 worse" in capsys.readouterr().out
    html = (tmp_path / "out" / "history.html").read_text(encoding="utf-8")
    assert "a$&lt;b&gt;" in html
    assert re.findall(r'(?:src|href)="(?!data:|#|figures/)[^"]*"', html) == []
    assert "<script" not in html
    made = {path.name for path in (tmp_path / "out").iterdir()}
    assert made == {
        "history.html", "history.json", "smaller_is_better.json", "bigger_is_better.json",
        "figures",
    }  # fmt: skip


def test_what_is_no_result_leaves_nothing_behind(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as exit_:
        cli.main(["history", str(tmp_path / "none"), "--out", str(tmp_path / "out")])
    assert exit_.value.code == console.EXIT_ERROR
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("airground: error: ")
    assert list(tmp_path.iterdir()) == []


def test_one_point_alone_makes_a_history() -> None:
    single: Measured = measured(SEEDS)
    made = history([point("one", single)])
    assert steps_table(made).rows == ()
    assert conclusion(made) == "1 revisions; steps: none"

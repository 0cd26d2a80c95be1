"""`accepted.json`: read back as written, with its history; refused where it is damaged."""

from __future__ import annotations

import json
from datetime import date
from pathlib import Path

import numpy as np
import pytest

from airground.errors import InputError
from evaluation.judge.accepted import Accepted, Measured
from evaluation.table.rows import ResultTable
from tests.evaluation.judge.flights import make_results

DAY = date(2024, 5, 17)


def measured_with_failures() -> Measured:
    frame = make_results(range(3)).frame.copy()
    frame.loc[frame["metric"] == "mav_ate_se3_rmse_m", "value"] = np.nan
    return Measured.of(ResultTable(frame))


def test_figures_are_read_back_as_they_were(tmp_path: Path) -> None:
    measured = measured_with_failures()
    path = tmp_path / "accepted.json"
    Accepted.of(measured, "abc123", "first", None, DAY).write(path)
    assert Accepted.read(path).measured() == measured
    assert [entry.name for entry in tmp_path.iterdir()] == ["accepted.json"]


def test_failures_are_null_and_lists_stay_on_one_line(tmp_path: Path) -> None:
    path = tmp_path / "accepted.json"
    Accepted.of(measured_with_failures(), "abc123", "why [not,  now]", None, DAY).write(path)
    made = json.loads(path.read_text())
    assert made["metrics"]["mav_trajectory"]["values"][-1] == [None]
    assert made["history"][0]["reason"] == "why [not,  now]"
    assert '  [ "flat", 0, 0 ],' in path.read_text().splitlines()


def test_the_history_of_reasons_is_kept() -> None:
    measured = measured_with_failures()
    first = Accepted.of(measured, "abc123", "first", None, DAY)
    second = Accepted.of(measured, "def456", " finer voxels ", first, DAY)
    assert [(one.git_revision, one.reason) for one in second.history] == [
        ("abc123", "first"),
        ("def456", "finer voxels"),
    ]
    assert second.history[0].headline["mav_trajectory"] is None
    assert second.history[0].headline["mav_tracked"] == 1.0


@pytest.mark.parametrize("reason", ["", "  \n"])
def test_accepting_without_a_reason_is_refused(reason: str) -> None:
    with pytest.raises(InputError, match="--reason: say why"):
        Accepted.of(measured_with_failures(), "abc123", reason, None, DAY)


@pytest.mark.parametrize(
    ("key", "value", "complaint"),
    [
        ("schema", 2, "schema: Input should be 1"),
        ("history", [], "history"),
        ("surprise", 1, "surprise: Extra inputs"),
    ],
)
def test_another_schema_is_refused(key: str, value: object, complaint: str, tmp_path: Path) -> None:
    path = tmp_path / "accepted.json"
    Accepted.of(measured_with_failures(), "abc123", "first", None, DAY).write(path)
    path.write_text(json.dumps(json.loads(path.read_text()) | {key: value}))
    with pytest.raises(InputError, match=complaint):
        Accepted.read(path)


def test_figures_of_a_version_that_watches_other_metrics_are_only_replaced(tmp_path: Path) -> None:
    path = tmp_path / "accepted.json"
    Accepted.of(measured_with_failures(), "abc123", "first", None, DAY).write(path)
    made = json.loads(path.read_text())
    del made["metrics"]["located"]
    path.write_text(json.dumps(made))
    before = Accepted.read(path)
    with pytest.raises(InputError, match="metric 'located' is not on both lists"):
        before.measured()
    after = Accepted.of(measured_with_failures(), "def456", "a metric more", before, DAY)
    assert [one.reason for one in after.history] == ["first", "a metric more"]
    assert after.measured() == measured_with_failures()


@pytest.mark.parametrize("content", [None, "no JSON", '{"schema": 1}'])
def test_what_is_no_accepted_file_is_one_clear_error(tmp_path: Path, content: str | None) -> None:
    path = tmp_path / "accepted.json"
    if content is not None:
        path.write_text(content)
    with pytest.raises(InputError, match=r"accepted\.json: "):
        Accepted.read(path)

"""Points of a history as they are read, and its steps as they are judged."""

from __future__ import annotations

import shutil
import subprocess
from dataclasses import replace
from datetime import date
from pathlib import Path

import numpy as np
import pytest

from airground.errors import InputError
from evaluation.judge.accepted import Accepted, Measured, headline
from evaluation.judge.history.points import Point, read_points
from evaluation.judge.history.series import history
from evaluation.judge.metrics import WATCHED
from evaluation.judge.summary import build_summary
from evaluation.judge.verdict import Verdict
from evaluation.setup.condition import RunInfo
from evaluation.table.rows import ResultTable
from tests.evaluation.judge.flights import make_results, measured

SEEDS = range(12)
WORSE = {"error_median_m": 1.4}
DAY = date(2024, 5, 17)


def point(name: str, found: Measured) -> Point:
    return Point(name, name, None, headline(found), found.samples, found.suite, found.condition)


def written(table: ResultTable, folder: Path, revision: str = "abc123") -> Path:
    """What history reads of a run's folder."""
    folder.mkdir(parents=True)
    table.write(folder / "results.parquet")
    run = RunInfo("0.1.0", revision, 0, "some CPU", 2)
    build_summary(table, table.conditions()[0], run).write(folder / "summary.json")
    return folder


def accept(path: Path, found: Measured, revision: str, reason: str) -> None:
    before = Accepted.read(path) if path.exists() else None
    Accepted.of(found, revision, reason, before, DAY).write(path)


def git(folder: Path, *words: str) -> None:
    name = ("-c", "user.name=a", "-c", "user.email=a@example.org")
    subprocess.run(["git", *name, *words], cwd=folder, check=True, capture_output=True)


@pytest.fixture(scope="module")
def good() -> Measured:
    return measured(SEEDS)


@pytest.fixture(scope="module")
def bad() -> Measured:
    return measured(SEEDS, WORSE)


def test_git_has_the_values_of_earlier_acceptances(
    good: Measured, bad: Measured, tmp_path: Path
) -> None:
    path = tmp_path / "accepted.json"
    git(tmp_path, "init", "-q")
    for found, revision in ((good, "one"), (bad, "two")):
        accept(path, found, revision, f"reason {revision}")
        git(tmp_path, "add", "accepted.json")
        git(tmp_path, "commit", "-q", "-m", revision)
    points = read_points([path])
    assert [(one.revision, one.reason, one.day) for one in points] == [
        ("one", "reason one", DAY),
        ("two", "reason two", DAY),
    ]
    assert points[0].samples == good.samples
    assert points[1].samples == bad.samples
    (step,) = history(points).steps()
    assert (step.metric.name, step.place, step.verdict) == ("surface_median", 1, Verdict.WORSE)


def test_outside_of_git_earlier_acceptances_have_figures_only(
    good: Measured, bad: Measured, tmp_path: Path
) -> None:
    path = tmp_path / "accepted.json"
    accept(path, good, "one", "first")
    accept(path, bad, "two", "second")
    points = read_points([path])
    assert [bool(one.samples) for one in points] == [False, True]
    found = history(points)
    (step,) = found.steps()
    assert (step.metric.name, step.flights, step.verdict) == ("surface_median", 0, Verdict.WORSE)
    assert np.isnan(step.p)
    assert next(s for s in found.series if s.metric.name == "surface_median").total is None


def test_a_folder_of_accepted_files_is_as_good_as_git(
    good: Measured, bad: Measured, tmp_path: Path
) -> None:
    path = tmp_path / "accepted-1.json"
    accept(path, good, "one", "first")
    (tmp_path / "accepted-2.json").write_bytes(path.read_bytes())
    accept(tmp_path / "accepted-2.json", bad, "two", "second")
    points = read_points([tmp_path])
    assert [(one.revision, bool(one.samples)) for one in points] == [("one", True), ("two", True)]


def test_folders_of_results_follow_in_natural_order(tmp_path: Path) -> None:
    first = written(make_results(range(2)), tmp_path / "run10", "of-run10")
    for name in ("run2", "run1"):
        shutil.copytree(first, tmp_path / name)
        summary = tmp_path / name / "summary.json"
        summary.write_text(summary.read_text().replace("of-run10", f"of-{name}"))
    assert [one.reason for one in read_points([tmp_path])] == ["run1", "run2", "run10"]
    (single,) = read_points([tmp_path / "run2"])
    assert (single.revision, single.day) == ("of-run2", None)


def test_a_version_without_a_metric_leaves_it_out(good: Measured, tmp_path: Path) -> None:
    path = tmp_path / "accepted.json"
    old = Accepted.of(good, "one", "first", None, DAY)
    metrics = {name: part for name, part in old.metrics.items() if name != "located"}
    old.model_copy(update={"metrics": metrics}).write(path)
    (only,) = read_points([path])
    assert "located" not in only.figures
    (located,) = [s for s in history([only]).series if s.metric.name == "located"]
    assert np.isnan(located.values).all()


def test_a_step_is_worse_and_the_way_back_is_better(good: Measured, bad: Measured) -> None:
    runs = [good, good, bad, bad, good]
    found = history([point(f"r{n}", run) for n, run in enumerate(runs)])
    seen = [(step.place, step.metric.name, step.verdict) for step in found.steps()]
    assert seen == [
        (4, "surface_median", Verdict.BETTER),
        (2, "surface_median", Verdict.WORSE),
    ]
    worse = found.steps()[1]
    assert worse.paired
    assert worse.flights == len(SEEDS)
    assert worse.change.low > 0
    assert worse.change.value == pytest.approx(0.4 * worse.before, rel=0.15)


def test_an_unchanged_program_has_no_step(good: Measured) -> None:
    found = history([point(f"r{n}", good) for n in range(4)])
    assert found.steps() == []
    assert all(series.total is None or series.total.value == 0 for series in found.series)


def test_a_change_that_does_not_matter_is_slight(good: Measured) -> None:
    little = measured(SEEDS, {"error_median_m": 1.03})
    runs = [good, good, good, little, little, little]
    found = history([point(f"r{n}", run) for n, run in enumerate(runs)])
    (step,) = found.steps()
    assert (step.place, step.verdict) == (3, Verdict.SLIGHTLY_WORSE)


def test_new_seeds_are_compared_as_two_samples(monkeypatch: pytest.MonkeyPatch) -> None:
    few = [metric for metric in WATCHED if metric.name.startswith("surface")]
    monkeypatch.setattr("evaluation.judge.history.series.WATCHED", few)
    runs = [measured(range(20 * n, 20 * n + 12), WORSE if n > 1 else None) for n in range(4)]
    found = history([point(f"r{n}", run) for n, run in enumerate(runs)])
    (step,) = [one for one in found.steps() if one.metric.name == "surface_median"]
    assert (step.place, step.paired, step.verdict) == (2, False, Verdict.WORSE)
    assert step.flights == 24


def test_intervals_are_over_flights_and_hold_the_figure(good: Measured) -> None:
    found = history([point("one", good)])
    for series in found.series:
        if np.isfinite(series.low[0]):
            assert series.low[0] <= series.values[0] <= series.high[0]
    known = [series for series in found.series if np.isfinite(series.low[0])]
    assert len(known) >= len(WATCHED) - 1


def test_other_conditions_are_left_out_and_counted(good: Measured) -> None:
    paper = replace(good, condition=replace(good.condition, preset="paper"))
    found = history([point("p", paper), point("one", good), point("two", good)])
    assert [one.revision for one in found.points] == ["one", "two"]
    assert list(found.left_out.values()) == [1]


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("nowhere", "no such file or folder"),
        ("empty", "has neither accepted"),
        ("half", "has no results.parquet"),
        ("text.json", "no accepted figures"),
    ],
)
def test_what_holds_no_result_is_one_clear_error(name: str, said: str, tmp_path: Path) -> None:
    (tmp_path / "empty").mkdir()
    (tmp_path / "text.json").write_text("{}")
    half = written(make_results([0]), tmp_path / "half")
    (half / "results.parquet").unlink()
    with pytest.raises(InputError, match=said):
        read_points([tmp_path / name])


def test_a_history_without_a_result_is_refused() -> None:
    with pytest.raises(InputError, match="no result"):
        history([])

"""`airground compare`: the page says what check says, and what it cannot say."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import pandas as pd
import pytest

from airground.config import Config
from evaluation import cli
from evaluation.judge.divergence import Difference, Held
from evaluation.judge.runs import Against, Run, against, distinct_names
from evaluation.judge.summary import build_summary
from evaluation.judge.verdict import Verdict, compare
from evaluation.setup import console
from evaluation.setup.settings import with_value, write_config
from evaluation.show.comparison.figures import comparison_figures
from evaluation.show.comparison.page import (
    PAGE,
    Parted,
    conditions_table,
    failures_moved,
    moved_table,
    overview_table,
    write_comparison,
)
from evaluation.table.rows import ResultTable
from tests.evaluation.judge.flights import make_results
from tests.evaluation.show.made_runs import INFO, made_run

SEEDS = range(10)
WORSE = {"error_median_m": 1.4}


def written(folder: Path, table: ResultTable, config: Config | None = None) -> Path:
    """What compare reads of a run's folder."""
    folder.mkdir(parents=True)
    table.write(folder / "results.parquet")
    write_config(config or Config(), folder / "config.toml")
    build_summary(table, table.conditions()[0], INFO).write(folder / "summary.json")
    return folder


def exit_code(*words: object) -> object:
    with pytest.raises(SystemExit) as exit_:
        cli.main([str(word) for word in words])
    return exit_.value.code


@pytest.fixture(scope="module")
def before() -> Run:
    return made_run("before", make_results(SEEDS))


def test_the_verdicts_are_those_of_check(before: Run) -> None:
    held = against(before, made_run("after", make_results(SEEDS, WORSE)))
    checked = compare(before.measured, held.run.measured)
    assert repr(held.comparison) == repr(checked)
    (row,) = moved_table(held).rows
    assert row[:2] == ("surface, median error", "worse")
    assert row[-1] == "10 flights"
    assert held.outcome() == "1 worse"


def test_only_flights_of_both_are_compared_and_that_is_said(before: Run) -> None:
    more = made_run("more", make_results(range(15), WORSE))
    held = against(before, more)
    alone = against(before, made_run("alone", make_results(SEEDS, WORSE)))
    assert repr(held.comparison.judged) == repr(alone.comparison.judged)
    assert any("5 that only one has are left out" in caveat for caveat in held.caveats())


def test_other_seeds_are_two_samples_and_that_is_said(before: Run) -> None:
    held = against(before, made_run("new", make_results(range(100, 110), {"error_median_m": 2.0})))
    assert [one.metric.name for one in held.comparison.of(Verdict.WORSE)] == ["surface_median"]
    assert "two samples" in held.caveats()[0]
    names = [figure.name for figure in comparison_figures([held])]
    assert "paired_differences" not in names
    assert "fig11_localization_error" in names


def test_fewer_trials_are_noticed(before: Run) -> None:
    frame = make_results(SEEDS).frame
    fewer = frame[~((frame["stage"] == "refinement") & (frame["trial"] == 3))]
    caveats = against(before, made_run("fewer", ResultTable(fewer))).caveats()
    assert caveats == [
        "Up to 3 refinement trials a flight against 4: what only one has counts as failed on the "
        "other."
    ]


def test_failures_that_came_and_went_are_distinguished(before: Run) -> None:
    frame = before.table.frame.copy()
    errors = (frame["metric"] == "error_m") & (frame["iteration"] == 4)
    first = frame.index[errors & (frame["scene"] == "tiny")][0]
    frame.loc[first, "value"] = 2.0
    moved = failures_moved(against(before, made_run("after", ResultTable(frame))))
    assert [failure.key for failure in moved.appeared] == [("sequence", "tiny", 0, 0, 0)]
    assert moved.appeared[0].story.rows[3][2] == "2.00 m"
    back = failures_moved(against(made_run("after", ResultTable(frame)), before))
    assert [failure.key for failure in back.went] == [("sequence", "tiny", 0, 0, 0)]
    assert moved.stayed == back.stayed
    assert back.appeared == []


def test_differences_of_parameters_machine_and_code_are_listed(before: Run) -> None:
    config = with_value(Config(), "localization", "particles", 77, "test")
    other = replace(INFO, cpu="another CPU", git_revision="def456")
    runs = [before, made_run("after", before.table, other, config)]
    differing = {row[0]: row[1:] for row in conditions_table(runs, common=False).rows}
    assert differing["localization.particles"][1] == "77"
    assert differing["machine"] == ("some CPU, 2 cores", "another CPU, 2 cores")
    assert set(differing) == {"localization.particles", "machine", "code"}
    assert "seeds of the flights" in {row[0] for row in conditions_table(runs, common=True).rows}


def test_several_runs_stand_in_one_overview(before: Run) -> None:
    helds = [
        against(before, made_run("rough", make_results(SEEDS, WORSE))),
        against(before, made_run("turned", make_results(SEEDS, {"after_rotation_deg": 0.5}))),
    ]
    overview = overview_table(helds)
    assert overview.header == ("metric", "before", "rough", "turned")
    cells = {row[0]: row[2:] for row in overview.rows}
    assert cells["surface, median error"][0].endswith("\nworse")
    assert cells["surface, median error"][1].endswith("\nno difference seen")
    assert cells["refined angle"][1].endswith("\nbetter")


def test_the_figure_draws_every_flight_s_difference(before: Run) -> None:
    held = against(before, made_run("after", make_results(SEEDS, WORSE)))
    figure = next(f for f in comparison_figures([held]) if f.name == "paired_differences").figure
    (axes,) = [one for one in figure.axes if one.get_title(loc="left")]
    assert axes.get_title(loc="left") == "surface, median error [mm]"
    dots, _ = [line for line in axes.lines if line.get_marker() == "o"]  # and the legend's
    each = sorted(_flight_medians(held))
    assert dots.get_ydata() == pytest.approx(each, rel=1e-3)


def _flight_medians(held: Against) -> list[float]:
    """Of the differences of surface errors [mm], by pandas."""
    columns = []
    for side in (held.reference, held.run):
        rows = side.table.scored().rows("surface", "error_median_m")
        columns.append(rows.set_index(["seed", "trial"])["value"])
    differences: pd.Series = 1e3 * (columns[1] - columns[0])
    return differences.groupby("seed").median().tolist()


def test_the_command_writes_a_page_that_needs_nothing_else(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    old = written(tmp_path / "a$<old>", make_results(SEEDS))
    new = written(tmp_path / "new", make_results(SEEDS, WORSE))
    assert exit_code("compare", old, new, "--out", tmp_path / "out") == console.EXIT_OK
    assert "1 worse: surface, median error" in capsys.readouterr().out
    html = (tmp_path / "out" / PAGE).read_text(encoding="utf-8")
    assert "new against a$&lt;old&gt;" in html
    assert re.findall(r'(?:src|href)="(?!data:|#|figures/)[^"]*"', html) == []
    assert "<script" not in html
    assert (tmp_path / "out" / "figures" / "paired_differences.pdf").is_file()


@pytest.mark.parametrize("failed", [False, True])
def test_two_runs_of_one_recording_make_a_page(
    failed: bool, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    frame = make_results([0]).frame
    first = (frame["sequence"].fillna(0) == 0) & (frame["trial"].fillna(0) == 0)
    single = frame[(frame["scene"] == "tiny") & first]
    changed = single.copy()
    changed.loc[changed["metric"] == "error_median_m", "value"] *= float("nan") if failed else 3.0
    old = written(tmp_path / "old", ResultTable(single))
    new = written(tmp_path / "new", ResultTable(changed))
    assert exit_code("compare", old, new, "--out", tmp_path / "out") == console.EXIT_OK
    assert "no verdict possible" in capsys.readouterr().out
    html = (tmp_path / "out" / PAGE).read_text(encoding="utf-8")
    assert "one observation: no verdict possible" in html


@pytest.mark.parametrize(
    ("others", "said"),
    [
        ([], "1 given; expected 2 to 4"),
        (["a"], "given twice"),
        (["nowhere"], "no such folder"),
        (["elsewhere"], "has no flight of a"),
    ],
)
def test_what_cannot_be_compared_is_one_line(
    others: list[str], said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    written(tmp_path / "a", make_results(SEEDS))
    written(tmp_path / "elsewhere", make_results(range(100, 104)))
    folders = [tmp_path / name for name in ("a", *others)]
    assert exit_code("compare", *folders, "--out", tmp_path / "out") == console.EXIT_ERROR
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("airground: error: ")
    assert said in line
    assert not (tmp_path / "out").exists()


def test_names_tell_folders_apart() -> None:
    folders = [Path("/x/one/run"), Path("/x/two/run"), Path("/x/two/other")]
    assert distinct_names(folders) == ["one/run", "two/run", "two/other"]
    assert distinct_names(folders[1:]) == ["run", "other"]


def test_the_page_says_where_two_runs_part(before: Run, tmp_path: Path) -> None:
    held = against(before, made_run("after", make_results(range(10), {"error_m": 1.5})))
    first = Difference(10_117_000_000, "0.1 m apart")
    differences = [Held("surface", 7, "0.17 mm", None), Held("belief", 7, "1.46 mm", first)]
    write_comparison(tmp_path, [held], [Parted(Path("a"), Path("b"), differences)])
    page = (tmp_path / PAGE).read_text(encoding="utf-8")
    assert "Where they part: the belief differs first, at 10.117 s" in page
    assert "airground view a b" in page
    assert "0.1 m apart" in page
    write_comparison(tmp_path, [held], [Parted(Path("a"), Path("b"), [])])
    assert "Where they part" not in (tmp_path / PAGE).read_text(encoding="utf-8")

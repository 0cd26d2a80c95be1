"""Several levels in one report: success by level and preset, and none with fewer."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from airground.config import Config
from evaluation.judge.results import AtLevel, Results, merged
from evaluation.setup.level_mark import LevelMark
from evaluation.setup.text import MISSING
from evaluation.show.report.levels import baselines_at, level_figures, level_table, presets_at
from evaluation.show.report.page import write_results
from evaluation.table.rows import ResultTable, Row
from tests.evaluation.judge.flights import CONDITION, make_results

IN_ORDER = (("paper", 1), ("hard", 1), ("hard", 2), ("a colleague's", 1))
MARKS = [LevelMark(name=name, version=1) for name in ("easy", "hard")]


def results_at(mark: LevelMark, off: float) -> Results:
    """All sequences of a level end so many times the usual error from the truth."""
    table = make_results(range(4), {"error_m": off}, lost=0.0)
    frame = table.frame.assign(variant="" if mark.name == "easy" else f"level {mark}")
    return Results(ResultTable(frame), Config(), 0, level=mark)


def test_success_falls_from_level_to_level() -> None:
    parts = [results_at(mark, off) for mark, off in zip(MARKS, (1.0, 100.0), strict=True)]
    both = merged(parts)
    assert both.level is None
    assert [one.level for one in both.levels] == MARKS
    made = level_table(both.levels)
    assert made.header == ("method", "aerial maps", "easy 1", "hard 1")
    ((method, maps, easy, hard),) = made.rows
    assert (method, maps) == ("best", "4")
    assert easy.startswith("100")
    assert hard.startswith("0")
    assert "wrong claims: 0 of" in easy
    (figure,) = level_figures(both.levels)
    assert figure.name == "levels"


def test_levels_stand_in_order_whatever_that_of_the_runs() -> None:
    marks = [LevelMark(name=name, version=version) for name, version in IN_ORDER]
    parts = [results_at(mark, 1.0) for mark in marks]
    for order in ((2, 0, 3, 1), (3, 2, 1, 0)):
        found = merged([parts[index] for index in order]).levels
        assert [one.level for one in found] == marks


def rivals(mark: LevelMark, near: int, trials: int = 8, turned_deg: float = 1.0) -> ResultTable:
    """A baseline that claims all its guesses, of which so many are right."""
    condition = replace(CONDITION, variant="" if mark.name == "easy" else f"level {mark}")
    return ResultTable.from_rows(
        Row("tiny", 0, 0, condition, "baseline", f"sift_{metric}", value, "", trial=trial)
        for trial in range(trials)
        for metric, value in (
            ("claimed", 1.0),
            ("horizontal_m", 0.1 if trial < near else 2.0),
            ("translation_m", 0.1),
            ("rotation_deg", turned_deg),
            ("ms", 40.0),
        )
    )


def test_baselines_are_held_against_levels_too() -> None:
    levels = []
    for mark, near in zip(MARKS, (8, 2), strict=True):
        result = results_at(mark, 1.0)
        levels.append(AtLevel(mark, ResultTable.concat([result.table, rivals(mark, near)])))
    rows = {row[0]: row[1:] for row in level_table(levels).rows}
    maps, easy, hard = rows["SIFT and PnP"]
    assert maps == "1"
    assert easy.splitlines()[0].startswith("100")
    assert easy.splitlines()[2:] == ["0.10 m, 40.0 ms", "wrong claims: 0 of 8"]
    assert hard.splitlines()[0].startswith("25")
    assert hard.splitlines()[2:] == ["2.00 m, 40.0 ms", "wrong claims: 6 of 8"]
    assert [figure.name for figure in level_figures(levels)] == ["levels", "levels_rivals"]


def test_a_guess_at_the_right_place_may_be_turned() -> None:
    easy = results_at(MARKS[0], 1.0)
    for turned_deg, right in ((2.9, 6), (3.1, 0)):
        tried = rivals(MARKS[0], 6, turned_deg=turned_deg)
        levels = [AtLevel(MARKS[0], ResultTable.concat([easy.table, tried]))]
        (sift,), (best,) = baselines_at(levels), presets_at(levels)
        (achieved,) = sift.achieved
        assert achieved is not None
        assert (achieved.success.successes, achieved.posed.successes) == (6, right)
        assert (sift.maps, best.maps) == (1, 4)


def test_what_was_not_measured_at_a_level_is_left_open() -> None:
    easy, hard = (results_at(mark, 1.0) for mark in MARKS)
    table = ResultTable.concat([hard.table, rivals(MARKS[1], 2)])
    levels = [AtLevel(MARKS[0], easy.table), AtLevel(MARKS[1], table)]
    (row,) = [row for row in level_table(levels).rows if row[0] == "SIFT and PnP"]
    assert row[2] == MISSING
    assert [figure.name for figure in level_figures(levels)] == ["levels"]


def test_runs_of_one_level_are_one_row_and_need_no_table() -> None:
    first = results_at(MARKS[1], 1.0)
    frame = first.table.frame.assign(seed=first.table.frame["seed"] + 100)
    both = merged([first, replace(first, table=ResultTable(frame))])
    assert both.level == MARKS[1]
    assert len(both.levels) == 1
    assert level_table(both.levels).rows == ()
    assert level_figures([AtLevel(MARKS[0], first.table)]) == []


def test_the_page_has_the_table_and_the_figure(tmp_path: Path) -> None:
    parts = [results_at(mark, off) for mark, off in zip(MARKS, (1.0, 100.0), strict=True)]
    write_results(merged(parts), tmp_path)
    page = (tmp_path / "report.html").read_text()
    assert 'id="levels"' in page
    assert "Success against level" in page
    assert (tmp_path / "figures" / "levels.png").exists()
    alone = tmp_path / "alone"
    alone.mkdir()
    write_results(parts[1], alone)
    page = (alone / "report.html").read_text()
    assert 'id="levels"' not in page
    assert "Level hard, version 1" in page

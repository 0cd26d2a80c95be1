"""Several levels in one report: success by level and preset, and none with fewer."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from airground.config import Config
from evaluation.judge.results import AtLevel, Results, merged
from evaluation.setup.level_mark import LevelMark
from evaluation.show.report.levels import level_figures, level_table
from evaluation.show.report.page import write_results
from evaluation.table.rows import ResultTable
from tests.evaluation.judge.flights import make_results

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
    assert made.header == ("level", "best")
    assert [row[0] for row in made.rows] == ["easy 1", "hard 1"]
    assert made.rows[0][1].startswith("100")
    assert made.rows[1][1].startswith("0")
    assert "wrong claims: 0 of" in made.rows[0][1]
    (figure,) = level_figures(both.levels)
    assert figure.name == "levels"


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

"""Runs that are kept for the page of measured levels: fewer rows, the same tables."""

from __future__ import annotations

import runpy
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pandas as pd
import pytest

from airground.config import Config
from airground.errors import InputError
from evaluation.judge.accepted import Measured
from evaluation.judge.results import Results, read_results
from evaluation.setup.level_mark import LevelMark
from evaluation.show.report.page import write_results
from evaluation.table.rows import ResultTable
from tests.evaluation.judge.flights import make_results

SCRIPT = Path(__file__).parents[1] / "docs" / "measured_levels.py"
MEASURED = runpy.run_path(str(SCRIPT))
HARD = LevelMark(name="hard", version=1)


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run of `best` at a level, of which all sequences are right."""
    folder = tmp_path_factory.mktemp("run")
    frame = make_results(range(4), lost=0.0).frame
    timed = frame.head(1).assign(stage="timing", metric="tracking_ms", value=20.0, unit="ms")
    table = ResultTable(pd.concat([frame, timed], ignore_index=True))
    write_results(Results(table, Config(), 0, level=HARD), folder)
    return folder


def test_a_run_is_kept_with_fewer_rows_and_the_same_table(run: Path, tmp_path: Path) -> None:
    MEASURED["keep"](run, "best", tmp_path)
    kept = tmp_path / "hard" / "best"
    whole, few = read_results(run).table, read_results(kept).table
    assert 0 < len(few) < len(whole)
    assert Measured.of(few) == Measured.of(whole), "compare has all that it judges"
    page = MEASURED["page"](tmp_path)
    assert "## `hard` 1" in page
    assert "All levels" not in page
    assert "| best | 4 | 100.0 % (" in page
    assert "`flat` 1, `tiny` 4; in `flat` there is nothing to find." in page
    elsewhere = tmp_path / "whole" / "hard"
    elsewhere.parent.mkdir()
    elsewhere.mkdir()
    (elsewhere / "best").symlink_to(run)
    assert MEASURED["page"](elsewhere.parent) == page


def test_levels_stand_in_order_and_one_without_best_has_its_methods(
    run: Path, tmp_path: Path
) -> None:
    results = read_results(run)
    medium = LevelMark(name="medium", version=1)
    frame = results.table.frame.assign(preset="paper")
    (tmp_path / "medium_run").mkdir()
    write_results(replace(results, table=ResultTable(frame), level=medium), tmp_path / "medium_run")
    MEASURED["keep"](run, "best", tmp_path / "kept")
    MEASURED["keep"](tmp_path / "medium_run", "paper", tmp_path / "kept")
    page = MEASURED["page"](tmp_path / "kept")
    together, apart = page.split("## `medium` 1")
    assert apart.index("| paper | 4 |") < apart.index("## `hard` 1") < apart.index("| best | 4 |")
    assert page.count("What `best` claims") == 1
    assert "![Success against level](pictures/levels.png)" in together
    assert "| best guess within 0.25 m | aerial maps | medium 1 | hard 1 |" in together
    best, paper = (line for line in together.splitlines() if line.startswith(("| best |", "| pa")))
    assert best.startswith("| best | 4 | - | 100.0 % (")
    assert paper.startswith("| paper | 4 | 100.0 % (")
    assert paper.endswith(" | - |")


def test_nothing_kept_is_a_page_without_levels(tmp_path: Path) -> None:
    assert "##" not in MEASURED["page"](tmp_path)


def test_what_cannot_be_kept_is_named_and_leaves_nothing(run: Path, tmp_path: Path) -> None:
    kept, no_level = tmp_path / "kept", tmp_path / "no_level"
    no_level.mkdir()
    write_results(replace(read_results(run), level=None), no_level)
    for wrong, name, said in (
        (no_level, "best", "states no level"),
        (tmp_path / "nowhere", "best", "no such folder"),
        (run, "../best", "expected the name of a folder"),
    ):
        with pytest.raises(InputError, match=said):
            MEASURED["keep"](wrong, name, kept)
    assert not kept.exists()
    MEASURED["keep"](run, "best", kept)
    for name, said in (("best", "exists"), ("again", "is there twice")):
        with pytest.raises(InputError, match=said):
            MEASURED["keep"](run, name, kept)
    assert [folder.name for folder in (kept / "hard").iterdir()] == ["best"]


@pytest.mark.parametrize("words", [["keep"], ["keep", "a", "b", "c"], ["keep", "nowhere", "best"]])
def test_wrong_words_are_one_line(words: list[str]) -> None:
    done = subprocess.run(
        [sys.executable, str(SCRIPT), *words], capture_output=True, text=True, cwd=SCRIPT.parents[1]
    )
    assert done.returncode == 2
    assert done.stdout == ""
    (line,) = done.stderr.splitlines()
    assert line.startswith("measured_levels.py: error: ")

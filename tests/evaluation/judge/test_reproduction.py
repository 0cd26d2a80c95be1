"""Verdicts on the paper's figures: numbers by their interval, words by what they say."""

from __future__ import annotations

import math

import pytest

from evaluation.judge.reproduction import FIGURES, PublishedFigure, reproduction_summary
from evaluation.judge.summary import build_summary
from evaluation.setup.condition import Condition, RunInfo
from evaluation.show.report.reproduction import reproduction_table
from evaluation.table.rows import ResultTable, Row
from tests.evaluation.synthetic_results import BEST, LITERAL, PAPER, make_table

TWIN = Condition("paper", "slam", "paper", "known")
BY_KEY = {figure.key: figure for figure in FIGURES}


def rows(scene: str, stage: str, values: dict[str, list[float]], **where: int) -> list[Row]:
    """Rows of one trial per value."""
    return [
        Row(scene, 0, 0, TWIN, stage, metric, value, "", trial=trial, **where)
        for metric, listed in values.items()
        for trial, value in enumerate(listed)
    ]


def verdict(key: str, table: ResultTable) -> str:
    return BY_KEY[key].verdict(BY_KEY[key].reading(table))


def located(errors: list[float], iteration: int, scene: str = "paper_a") -> ResultTable:
    return ResultTable.from_rows(
        Row(scene, 0, 0, TWIN, "localization", "error_m", error, "m", sequence, iteration)
        for sequence, error in enumerate(errors)
    )


@pytest.mark.parametrize(
    ("near", "far", "said"), [(26, 14, "reproduced"), (40, 0, "better"), (4, 36, "worse")]
)
def test_a_share_is_reproduced_where_its_interval_holds_the_published_one(
    near: int, far: int, said: str
) -> None:
    table = located([0.3] * near + [0.7] * far, 1)
    assert verdict("fig11_within_50cm_1", table) == said


def test_a_median_is_better_where_its_interval_lies_below() -> None:
    def refined(errors: list[float]) -> ResultTable:
        return ResultTable.from_rows(
            rows("paper_a", "refinement", {"after_translation_m": errors}, sequence=0)
        )

    assert verdict("fig13_refined_m", refined([0.01] * 20)) == "better"
    assert verdict("fig13_refined_m", refined([0.2] * 20)) == "worse"
    assert verdict("fig13_refined_m", refined([0.05, 0.1] * 20)) == "reproduced"
    failed = refined([math.nan] * 20)
    assert verdict("fig13_refined_m", failed) == "worse"


def test_one_published_run_is_compared_with_the_range_of_ours() -> None:
    def flown(errors_m: list[float]) -> ResultTable:
        return ResultTable.from_rows(
            Row("paper_b", seed, 0, TWIN, "trajectory", "mav_ate_se3_rmse_m", error, "m")
            for seed, error in enumerate(errors_m)
        )

    assert verdict("fig09_mav", flown([0.004, 0.02])) == "reproduced"
    assert verdict("fig09_mav", flown([0.004, 0.011])) == "better"
    assert verdict("fig09_mav", flown([0.02, 0.03])) == "worse"


def asift(scene: str, correct: int, wrong: int, silent: int) -> list[Row]:
    off = [0.1] * correct + [2.0] * wrong + [math.nan] * silent
    claimed = [1.0] * (correct + wrong) + [0.0] * silent
    return rows(scene, "baseline", {"asift_claimed": claimed, "asift_horizontal_m": off})


def test_asift_is_counted_indoors_and_outdoors_apart() -> None:
    table = ResultTable.from_rows(
        asift("paper_a", 3, 2, 15) + asift("paper_outdoor", 1, 4, 15) + asift("flat", 9, 0, 0)
    )
    found = reproduction_summary(table)
    indoors, outdoors = (found[f"fig03_asift_{place}"] for place in ("indoors", "outdoors"))
    assert (indoors.value, indoors.n, indoors.verdict) == (0.15, 20, "reproduced")
    assert (outdoors.value, outdoors.n, outdoors.verdict) == (0.05, 20, "reproduced")
    more = ResultTable.from_rows(asift("paper_outdoor", 2, 0, 18))
    assert verdict("fig03_asift_outdoors", more) == "worse"
    assert verdict("fig03_asift_indoors", more) == "not measured"


def test_a_baseline_that_was_not_run_is_no_pair_of_asift() -> None:
    missing = Row("paper_a", 0, 0, TWIN, "baseline", "xfeat_missing", 1.0, "")
    found = reproduction_summary(ResultTable.from_rows([*asift("paper_a", 3, 2, 15), missing]))
    assert (found["fig03_asift_indoors"].value, found["fig03_asift_indoors"].n) == (0.15, 20)


def test_outdoor_sequences_count_in_their_own_row_only() -> None:
    table = ResultTable.concat(
        [located([0.1] * 10, 4), located([9.0] * 10, 4, scene="paper_outdoor")]
    )
    found = reproduction_summary(table)
    assert found["fig11_within_25cm_4"].value == 1.0
    assert (found["fig15_outdoors"].value, found["fig15_outdoors"].verdict) == (0.0, "worse")
    assert table.scored().scenes() == ["paper_a"]


def test_nothing_measured_is_no_verdict() -> None:
    empty = ResultTable.from_rows([])
    assert {figure.verdict(figure.reading(empty)) for figure in FIGURES} == {"not measured"}


def test_the_summary_has_every_figure_with_the_papers_constants_only() -> None:
    table = make_table(conditions=(PAPER, LITERAL, BEST))
    run = RunInfo("0", "abc", 7, "cpu", 2)
    found = build_summary(table, PAPER, run).reproduction
    assert found is not None
    assert list(found) == list(BY_KEY)
    assert build_summary(table, BEST, run).reproduction is None


def test_the_table_has_a_column_a_condition_and_the_verdict_of_the_first() -> None:
    table = make_table(conditions=(PAPER, LITERAL, BEST))
    shown = reproduction_table(table, table.conditions())
    assert all(len(row) == len(shown.header) for row in shown.rows)
    assert len(shown.rows) == len(FIGURES)
    row = next(row for row in shown.rows if "within 0.25 m" in row[0])
    figure: PublishedFigure = BY_KEY["fig11_within_25cm_4"]
    assert row[1] == "89 %"
    assert row[-2] == figure.verdict(figure.reading(table.of(PAPER)))
    assert reproduction_table(table, [BEST, PAPER]).rows == ()

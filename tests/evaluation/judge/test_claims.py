"""Claims are counted case by case: right, wrong, and where there is nothing to be claimed."""

from __future__ import annotations

from evaluation.judge.claims import claims_summary, localization_claims, refinement_claims
from evaluation.show.report.calibration import claims_table
from evaluation.table.rows import ResultTable, Row
from tests.evaluation.synthetic_results import BEST, SCENES, make_table


def localization(scene: str, stage: str, errors: list[float | None], claimed: str) -> list[Row]:
    """One sequence; "x" marks a claim."""
    rows = []
    for iteration, (error, mark) in enumerate(zip(errors, claimed, strict=True), 1):
        where = (scene, 1, 0, BEST, stage)
        rows.append(Row(*where, "converged", float(mark == "x"), "", 0, iteration))
        if error is not None:
            rows.append(Row(*where, "error_m", error, "m", 0, iteration))
    return rows


def refinement(
    scene: str, stage: str, poses: list[tuple[float, float]], accepted: str
) -> list[Row]:
    """Trials with errors in metres and degrees; "x" marks those accepted."""
    rows = []
    for trial, (pose, mark) in enumerate(zip(poses, accepted, strict=True)):
        for metric, value in (
            ("after_translation_m", pose[0]),
            ("after_rotation_deg", pose[1]),
            ("accepted", float(mark == "x")),
        ):
            rows.append(Row(scene, 1, 0, BEST, stage, metric, value, "", trial=trial))
    return rows


ROWS = [
    *localization("indoor_a", "localization", [0.1, 0.24, 0.26, 2.0, 0.1], "xxx.."),
    *localization("flat", "localization", [1.0, 0.1], ".x"),
    # A claim without overlap is wrong even where it happens to be near.
    *localization("indoor_a", "no_overlap", [0.1, 1.0, 1.0, 1.0], "x..."),
    *localization("indoor_a", "wrong_map", [None, None, None], "..."),
    *refinement("indoor_a", "refinement", [(0.01, 0.1), (0.06, 0.1), (0.01, 2.1)], "xx."),
    *refinement("indoor_a", "no_overlap", [(0.01, 0.1), (0.8, 9.0)], "x."),
    *refinement("indoor_a", "wrong_map", [(0.8, 9.0)], "."),
]
TABLE = ResultTable.from_rows(ROWS)


def test_every_case_is_counted_and_all_of_them_are_their_sum() -> None:
    counted = {
        case: (c.wrong.successes, c.accepted.successes, c.accepted.total)
        for case, c in localization_claims(TABLE).items()
    }
    assert counted == {
        "found": (1, 3, 5),
        "no_structure": (1, 1, 2),
        "no_overlap": (1, 1, 4),
        "wrong_map": (0, 0, 3),
        "all": (3, 5, 14),
    }
    counted = {
        case: (c.wrong.successes, c.accepted.successes, c.accepted.total)
        for case, c in refinement_claims(TABLE).items()
    }
    assert counted == {
        "found": (1, 2, 3),
        "no_overlap": (1, 1, 2),
        "wrong_map": (0, 0, 1),
        "all": (2, 3, 6),
    }


def test_negatives_enter_no_success_rate() -> None:
    assert len(TABLE.scored().sequences("error_m")) == 1
    assert len(TABLE.trials()) == 3


def test_a_claim_without_an_error_is_wrong() -> None:
    rows = localization("indoor_a", "localization", [float("nan")], "x")
    assert localization_claims(ResultTable.from_rows(rows))["found"].wrong.successes == 1


def test_control_scenes_alone_have_no_place_to_be_found() -> None:
    rows = localization("flat", "localization", [1.0, 1.0], "x.")
    claims = localization_claims(ResultTable.from_rows(rows))
    assert list(claims) == ["no_structure", "all"]
    assert claims["all"].wrong.share == 1.0


def test_without_any_case_there_are_no_claims() -> None:
    nothing = ResultTable.from_rows([])
    assert localization_claims(nothing) == refinement_claims(nothing) == {}
    assert claims_table(nothing).rows == ()


def test_the_table_has_a_row_for_each_case() -> None:
    rows = {row[0]: row[1:] for row in claims_table(TABLE).rows}
    assert rows["a place to find"][0] == "5"
    assert rows["a place to find"][1].startswith("60.0 %\n3 of 5;")
    assert rows["a place to find"][2].startswith("33.3 %\n1 of 3;")
    assert rows["flat: no structure"][3:] == ("0", "-", "-")
    assert rows["another scene's ground map"][1].startswith("0.0 %\n0 of 3;")
    assert rows["another scene's ground map"][2] == "-"
    assert rows["all together"][5].startswith("66.7 %\n2 of 3;")


def test_the_summary_has_the_same_counts() -> None:
    table = make_table(conditions=(BEST,))
    made = claims_summary(table.of(BEST))
    false = made.localization["wrong_map"].wrong
    assert (false.count, false.total, false.share) == (len(SCENES), len(SCENES), 1.0)
    asked = {case: part.accepted.total for case, part in made.localization.items()}
    assert asked["wrong_map"] == asked["no_overlap"] == 24 * len(SCENES)
    assert asked["all"] == sum(count for case, count in asked.items() if case != "all")
    assert made.refinement["no_overlap"].wrong.share is None

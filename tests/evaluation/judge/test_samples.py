"""Where the watched values come from, and what counts as failed."""

from __future__ import annotations

import math

import numpy as np
import pytest

from evaluation.judge.accepted import figure
from evaluation.judge.metrics import WATCHED
from evaluation.judge.samples import Flight
from evaluation.setup.condition import Condition
from evaluation.table.rows import ResultTable, Row

METRICS = {metric.name: metric for metric in WATCHED}
CONDITION = Condition("best", "slam", "nominal", "known")
HERE = Flight("tiny", 3, 0)


def table(*rows: tuple[str, str, float, dict[str, int]]) -> ResultTable:
    seen = Row("tiny", 3, 0, CONDITION, "run", "recorded_s", 20.0, "s")
    made = [
        Row("tiny", 3, 0, CONDITION, stage, metric, value, "", **where)  # type: ignore[arg-type]
        for stage, metric, value, where in rows
    ]
    return ResultTable.from_rows([seen, *made])


def localization(*errors: float, claims: tuple[float, ...] = ()) -> ResultTable:
    rows: list[tuple[str, str, float, dict[str, int]]] = []
    for iteration, error in enumerate(errors, 1):
        where = {"sequence": 0, "iteration": iteration}
        claim = claims[iteration - 1] if claims else 1.0
        rows.append(("localization", "error_m", error, where))
        rows.append(("localization", "converged", claim, where))
    return table(*rows)


def refinement(metres: float, degrees: float, accepted: float) -> ResultTable:
    return table(
        ("refinement", "after_translation_m", metres, {"trial": 0}),
        ("refinement", "after_rotation_deg", degrees, {"trial": 0}),
        ("refinement", "accepted", accepted, {"trial": 0}),
    )


def test_names_are_unique_and_every_metric_says_why() -> None:
    assert len(METRICS) == len(WATCHED)
    for metric in WATCHED:
        assert metric.why
        assert metric.matters > 0


def test_localization_is_judged_at_the_iterations_that_are_named() -> None:
    made = localization(0.4, 0.1, 0.1, np.nan)
    expected = {
        "localization_1": [0.4],
        "localization_4": [math.inf],
        "within_50cm_1": [1.0],
        "within_25cm_4": [0.0],
        "located": [1.0, 1.0, 1.0, 1.0],
    }
    for name, values in expected.items():
        assert METRICS[name].samples(made) == {HERE: values}, name


def test_a_sequence_too_short_for_an_iteration_failed() -> None:
    assert METRICS["localization_4"].samples(localization(0.1)) == {HERE: [math.inf]}


def test_only_claims_can_be_wrong() -> None:
    made = localization(0.3, 0.3, 0.2, np.nan, claims=(1.0, 0.0, 1.0, 1.0))
    assert METRICS["located_wrongly"].samples(made) == {HERE: [1.0, 0.0, 0.0, 1.0]}


@pytest.mark.parametrize(
    ("metres", "degrees", "accepted", "well", "wrongly"),
    [
        (0.04, 1.9, 1.0, 1.0, 0.0),
        (0.04, 2.1, 1.0, 0.0, 1.0),
        (0.06, 0.1, 1.0, 0.0, 1.0),
        (0.06, 0.1, 0.0, 0.0, 0.0),
        (0.04, 0.1, 0.0, 0.0, 0.0),
    ],
)
def test_refinement(
    metres: float, degrees: float, accepted: float, well: float, wrongly: float
) -> None:
    made = refinement(metres, degrees, accepted)
    assert METRICS["refined_well"].samples(made) == {HERE: [well]}
    assert METRICS["refined_wrongly"].samples(made) == {HERE: [wrongly]}


def test_a_flight_that_gave_nothing_is_still_there() -> None:
    made = table()
    assert METRICS["surface_median"].samples(made) == {HERE: []}
    assert METRICS["aerial_maps"].samples(made) == {HERE: [0.0]}
    assert METRICS["refined_well"].samples(made) == {HERE: []}


def test_surfaces_come_in_order() -> None:
    rows = [("surface", "error_median_m", 0.001 * k, {"trial": k}) for k in (10, 2, 1)]
    assert METRICS["surface_median"].samples(table(*rows)) == {HERE: [0.001, 0.002, 0.01]}


def test_every_flight_weighs_the_same_in_a_figure() -> None:
    samples = {HERE: [1.0, 1.0, 1.0, 1.0], Flight("tiny", 4, 0): [0.0]}
    assert figure(METRICS["located"], samples) == 0.5
    errors = {HERE: [0.1, 0.2, math.inf], Flight("tiny", 4, 0): [0.4]}
    assert figure(METRICS["localization_1"], errors) == pytest.approx(0.3)
    assert np.isnan(figure(METRICS["located"], {}))

"""Metrics that got worse, with the moment from which a run differs."""

from __future__ import annotations

from dataclasses import replace

import pytest

from evaluation.judge.divergence import Difference, Held
from evaluation.judge.metrics import METRICS, WATCHED
from evaluation.judge.verdict import Compared, Comparison, Judged, Verdict
from evaluation.judge.worsened import KIND_OF, worsened
from evaluation.setup.condition import Condition
from evaluation.table.comparison import Effect

CONDITION = Condition("best", "slam", "nominal", "known", "")
BELIEF = Held("belief", 5, "1 mm", Difference(3_000_000_000, "5 mm apart"))
POSE = Held("MAV's pose", 90, "1 mm", None)
MATTERS = 0.002


def judged(name: str, change: float, verdict: Verdict = Verdict.SINGLE) -> Judged:
    compared = Compared(Effect(change, change, change, 1.0), 1, True)
    return Judged(METRICS[name], 0.1, 0.1 + change, compared, 1.0, MATTERS, verdict)


def named(*metrics: Judged) -> list[tuple[str, str]]:
    comparison = Comparison("tiny x 1", CONDITION, True, list(metrics))
    return [(one.metric.name, held.kind) for one, held in worsened(comparison, [BELIEF, POSE])]


@pytest.mark.parametrize(
    ("name", "change", "worse"),
    [
        ("localization_1", 0.005, True),
        ("localization_1", -0.005, False),
        ("localization_1", 0.001, False),
        ("located", -0.2, True),
        ("located", 0.2, False),
    ],
)
def test_one_observation_counts_from_what_matters_on(name: str, change: float, worse: bool) -> None:
    assert named(judged(name, change)) == ([(name, "belief")] if worse else [])


def test_no_change_is_not_worse_where_everything_matters() -> None:
    assert named(replace(judged("located", 0.0), matters=0.0)) == []


@pytest.mark.parametrize("verdict", Verdict)
def test_a_verdict_decides_where_there_is_one(verdict: Verdict) -> None:
    expected = verdict in (Verdict.WORSE, Verdict.SLIGHTLY_WORSE)
    found = named(judged("localization_1", 0.0, verdict))
    assert found == ([("localization_1", "belief")] if expected else [])


def test_a_kind_that_does_not_differ_names_no_moment() -> None:
    assert named(judged("mav_trajectory", 0.1, Verdict.WORSE)) == []


def test_every_watched_metric_of_a_run_has_a_kind() -> None:
    apart = {metric.name for metric in WATCHED} - KIND_OF.keys()
    assert all(name.startswith("wide_") for name in apart)

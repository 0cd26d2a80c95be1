"""Verdicts on made-up flights: what is flagged, what is not, and what cannot be compared."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from airground.errors import InputError
from evaluation.judge.accepted import Measured
from evaluation.judge.metrics import WATCHED
from evaluation.judge.verdict import ALPHA, Verdict, compare
from evaluation.table.comparison import least_paired_p
from evaluation.table.rows import ResultTable
from tests.evaluation.judge.flights import make_results, measured

SEEDS = range(10)


def worse(before: Measured, after: Measured) -> list[str]:
    return [judged.metric.name for judged in compare(before, after).of(Verdict.WORSE)]


def better(before: Measured, after: Measured) -> list[str]:
    return [judged.metric.name for judged in compare(before, after).of(Verdict.BETTER)]


def changed(table: ResultTable, metric: str, change: object) -> ResultTable:
    frame = table.frame.copy()
    chosen = frame["metric"] == metric
    frame.loc[chosen, "value"] = change(frame[chosen])  # type: ignore[operator]
    return ResultTable(frame)


def test_identical_results_show_no_difference() -> None:
    before = measured(SEEDS)
    judged = compare(before, before).judged
    assert {one.verdict for one in judged} == {Verdict.SAME}
    assert all(one.compared is not None and one.compared.effect.value == 0 for one in judged)


def test_a_metric_that_got_worse_is_named_and_no_other() -> None:
    before = measured(SEEDS)
    after = measured(SEEDS, {"after_translation_m": 1.2}, noise=0.02)
    assert worse(before, after) == ["refined_translation"]
    assert better(after, before) == ["refined_translation"]


def test_a_change_too_small_to_matter_is_reported_but_fails_nothing() -> None:
    before, after = measured(SEEDS), measured(SEEDS, {"after_translation_m": 1.01})
    assert worse(before, after) == []
    (slight,) = compare(before, after).of(Verdict.SLIGHTLY_WORSE)
    assert slight.metric.name == "refined_translation"
    assert len(compare(after, before).of(Verdict.SLIGHTLY_BETTER)) == 1


def test_a_change_without_a_direction_is_no_difference() -> None:
    assert worse(measured(SEEDS), measured(SEEDS, noise=0.3)) == []


def test_new_failures_are_worse_than_any_number() -> None:
    table = make_results(SEEDS)
    failed = changed(table, "after_translation_m", lambda rows: np.nan)
    found = worse(Measured.of(table), Measured.of(failed))
    assert "refined_translation" in found
    assert "refined_well" in found
    assert "refined_translation" in better(Measured.of(failed), Measured.of(table))


def test_what_is_missing_failed() -> None:
    table = make_results(SEEDS)
    frame = table.frame
    # A change that loses two thirds of the aerial maps must not look better for it.
    kept = frame[~((frame["stage"] == "surface") & (frame["trial"] >= 2))]
    found = worse(Measured.of(table), Measured.of(ResultTable(kept)))
    assert {"aerial_maps", "surface_median", "completeness"} <= set(found)


def test_a_wrong_claim_is_worse_than_none() -> None:
    table = make_results(SEEDS, lost=0.0)
    far = changed(table, "error_m", lambda rows: rows["value"] + 1.0)
    assert "located_wrongly" in worse(Measured.of(table), Measured.of(far))
    silent = changed(far, "converged", lambda rows: 0.0)
    assert "located_wrongly" not in worse(Measured.of(table), Measured.of(silent))


def test_a_claim_in_a_control_scene_is_worse() -> None:
    table = make_results(SEEDS)
    frame = table.frame.copy()
    claims = (frame["scene"] == "flat") & (frame["metric"] == "converged")
    # Enough aerial maps for the one control flight to say something.
    more = [frame[claims].assign(value=1.0, sequence=sequence) for sequence in range(1, 6)]
    quiet = [frame[claims].assign(sequence=sequence) for sequence in range(1, 6)]
    before, after = (ResultTable(pd.concat([frame, *rows])) for rows in (quiet, more))
    assert worse(Measured.of(before), Measured.of(after)) == ["control_claims"]


def test_few_flights_fall_back_on_their_trials_and_say_so() -> None:
    before, after = measured(range(4)), measured(range(4), {"error_median_m": 1.5})
    judged = {one.metric.name: one for one in compare(before, after).judged}
    surface = judged["surface_median"]
    assert surface.compared is not None
    assert (surface.compared.count, surface.compared.by_flight) == (24, False)
    assert surface.verdict == Verdict.WORSE


def test_ten_flights_are_the_fewest_that_can_say_something() -> None:
    assert least_paired_p(10) * len(WATCHED) <= ALPHA < least_paired_p(9) * len(WATCHED)


def test_new_seeds_are_two_samples() -> None:
    before, after = measured(SEEDS), measured(range(100, 110), {"error_median_m": 2.0})
    comparison = compare(before, after)
    assert not comparison.paired
    assert [one.metric.name for one in comparison.of(Verdict.WORSE)] == ["surface_median"]


def test_other_suites_and_half_of_the_seeds_are_refused() -> None:
    before = measured(SEEDS)
    with pytest.raises(InputError, match=r"tiny x 4; expected flat x 1, tiny x 10"):
        compare(before, measured(range(4)))
    with pytest.raises(InputError, match=r"5 of 11 flights are the same"):
        compare(before, measured(range(5, 15)))


def test_nothing_measured_is_no_verdict() -> None:
    table = make_results(SEEDS)
    frame = table.frame[table.frame["stage"] != "refinement"]
    part = Measured.of(ResultTable(frame))
    unmeasured = {one.metric.name for one in compare(part, part).of(Verdict.UNMEASURED)}
    assert unmeasured == {
        "refined_translation",
        "refined_rotation",
        "refined_well",
        "refinement_accepted",
        "refined_wrongly",
    }


@pytest.mark.slow
def test_twenty_reruns_with_new_seeds_hardly_alarm() -> None:
    accepted = measured(SEEDS)
    reruns = [measured(range(100 * n, 100 * n + 10)) for n in range(1, 21)]
    alarms = [worse(accepted, rerun) for rerun in reruns]
    assert sum(bool(names) for names in alarms) <= 1, alarms

"""How answers are judged, and what the report makes of them."""

from __future__ import annotations

from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np
import pytest

from airground.config import Config
from airground.core.se3 import SE3
from airground.errors import InputError
from evaluation.cli import parse
from evaluation.commands.reproduce import Reproduce
from evaluation.measure.baselines import measure
from evaluation.measure.baselines.interface import Answer, Baseline, Given
from evaluation.measure.baselines.table import BASELINES
from evaluation.measure.protocol.trials import (
    Protocol,
    refine_sighting,
    spread_evenly,
    trial_sightings,
)
from evaluation.setup.condition import Condition
from evaluation.show.report.baselines import baseline_table, baseline_trials
from evaluation.table.row_writer import RowWriter
from evaluation.table.rows import ResultTable
from tests.evaluation.measure.closed_worlds import T_GROUND_MAV, boxes_on_floor, given_of

CONDITION = Condition("best", "slam", "nominal", "known")


@dataclass(frozen=True)
class ClosedTruth:
    """The world's frame is `ground`."""

    T_world_mav: SE3
    T_world_ground: SE3

    def T_world_mav_camera(self, stamp_ns: int) -> SE3:
        return self.T_world_mav

    def T_world_ground_camera(self, stamp_ns: int) -> SE3:
        return self.T_world_ground


def closed_truth(given: Given) -> ClosedTruth:
    sighting = given.sighting
    return ClosedTruth(T_GROUND_MAV @ sighting.T_mav_camera, sighting.T_ground_camera)


def echo(given: Given) -> Answer:
    return Answer(given.prior, "") if given.prior else Answer(None, "no prior")


def test_each_gets_the_prior_that_its_line_declares() -> None:
    given = given_of(boxes_on_floor())
    truth = closed_truth(given)
    asked = [Baseline(p, p, p, echo, prior=p) for p in ("none", "noisy", "truth")]
    answers = measure.ask_all(
        asked, None, None, given.sighting, truth, Config(), (3, 1), 5  # type: ignore[arg-type]
    )  # fmt: skip
    none, noisy, exact = (answer for answer, _ in answers)
    assert none.T_ground_mav is None
    assert noisy.T_ground_mav is not None
    assert exact.T_ground_mav is not None
    np.testing.assert_allclose(exact.T_ground_mav.matrix(), T_GROUND_MAV.matrix(), atol=1e-9)
    # The noisy prior is the start of the refinement trial with the same number.
    rng = np.random.default_rng([3, 1, 2, 5])
    trial = refine_sighting(given.sighting, T_GROUND_MAV, Config(), rng)
    error = measure.pose_error(noisy.T_ground_mav, given.sighting, truth)  # type: ignore[arg-type]
    assert error.translation_m == pytest.approx(trial.errors["before"].translation_m)
    assert error.rotation_deg == pytest.approx(trial.errors["before"].rotation_deg)
    assert error.translation_m > 0.05


def moved_by(x_m: float) -> SE3:
    return SE3(T_GROUND_MAV.rotation, T_GROUND_MAV.translation + np.array([x_m, 0, 0]))


def rows_of(answers: list[Answer], name: str = "icp", scene: str = "indoor_a") -> ResultTable:
    given = given_of(boxes_on_floor(0.1))
    out = RowWriter(scene, 0, 0, CONDITION)
    for trial, answer in enumerate(answers):
        measure._add_answer(
            out, name, answer, 10.0 * trial, given.sighting, closed_truth(given), trial  # type: ignore[arg-type]
        )  # fmt: skip
    return ResultTable.from_rows(out.rows)


def test_wrong_claims_are_counted_apart_from_abstentions() -> None:
    answers = [
        Answer(moved_by(0.01)),
        Answer(moved_by(0.2)),
        Answer(moved_by(0.3)),
        Answer(moved_by(0.1), "not sure"),
        Answer(None, "no idea"),
    ]
    table = baseline_table(rows_of(answers))
    (row,) = table.rows
    cells = dict(zip(table.header, row, strict=True))
    assert cells["n"] == "5"
    assert cells["claims a place within 0.25 m"].startswith("40.0 %\n2 of 5")
    assert cells["wrong claims"].startswith("20.0 %\n1 of 5")
    assert cells["claims within 5 cm and 2°"].startswith("20.0 %\n1 of 5")
    assert cells["best guess within 0.25 m"].startswith("60.0 %\n3 of 5")
    assert cells["best guess, median error"].startswith("0.20 m")
    assert cells["median time [ms]"] == "20.0"


def test_claims_where_nothing_is_to_find_are_counted_by_themselves() -> None:
    lost = [Answer(moved_by(0.0)), Answer(moved_by(1.0)), Answer(None, "too flat")]
    table = ResultTable.concat([rows_of([Answer(moved_by(0.0))]), rows_of(lost, scene="flat")])
    shown = baseline_table(table)
    cells = dict(zip(shown.header, shown.rows[0], strict=True))
    assert cells["n"] == "1"
    assert cells["claims on flat ground"].startswith("66.7 %\n2 of 3")
    assert "claims on flat ground" not in baseline_table(rows_of(lost[:1])).header


def test_no_guess_at_all_is_a_failure_in_the_median() -> None:
    answers = [Answer(None, "no idea"), Answer(None, "no idea"), Answer(moved_by(0.0))]
    (row,) = baseline_table(rows_of(answers)).rows
    assert "failed\nfailed" in row
    assert np.isnan(baseline_trials(rows_of(answers), "icp")["horizontal_m"]).sum() == 2


def test_reasons_stay_in_the_rows() -> None:
    rows = rows_of([Answer(None, "no idea")]).rows("baseline", "icp_claimed")
    assert list(rows["note"]) == ["no idea"]
    assert list(rows["value"]) == [0.0]


def test_a_missing_module_is_said_and_not_counted() -> None:
    out = RowWriter("indoor_a", 0, 0, CONDITION)
    reason = "kiss_matcher is not installed"
    out.add("baseline", "kiss_missing", 1.0, "", note=reason)
    (row,) = baseline_table(ResultTable.from_rows(out.rows)).rows
    assert row[3] == f"not run\n{reason}"


def test_what_is_not_installed_is_found_out_with_how_to_install_it() -> None:
    made_up = Baseline("x", "x", "x", echo, module="airground_no_such_module", install="do this")
    reason = "airground_no_such_module is not installed: do this"
    assert measure.why_not_run(made_up) == reason
    assert measure.why_not_run(Baseline("x", "x", "x", echo, module="numpy.linalg")) == ""
    assert measure.why_not_run(BASELINES[0]) == ""


def test_what_a_baseline_loads_is_loaded_before_its_first_answer() -> None:
    loaded = []
    ready = Baseline("x", "x", "x", echo, prepare=lambda: loaded.append(1))
    assert measure.why_not_run(ready) == ""
    assert loaded == [1]

    def no_weights() -> None:
        raise ImportError("no weights", name="weights")

    lacking = Baseline("x", "x", "x", echo, prepare=no_weights, install="do this")
    assert measure.why_not_run(lacking) == "weights is not installed: do this"


def test_a_baseline_that_is_not_installed_is_not_tried(monkeypatch: pytest.MonkeyPatch) -> None:
    """Its one row says how to install it, and is no answer of any trial."""
    made_up = Baseline("x", "x", "x", echo, module="airground_no_such_module")
    monkeypatch.setattr(measure, "BASELINES", (made_up, Baseline("y", "y", "y", echo)))
    monkeypatch.setattr(measure, "GroundViews", lambda *_: None)
    given = given_of(boxes_on_floor(0.1))
    front_end = SimpleNamespace(live_poses=list)
    maps = SimpleNamespace(
        sightings=[given.sighting], tracked={"ground": SimpleNamespace(front_end=front_end)}
    )
    out = RowWriter("indoor_a", 0, 0, CONDITION)
    measure.add_baselines(
        out, None, closed_truth(given), Config(), maps, (0, 0), Protocol(trials=1, baselines=1)  # type: ignore[arg-type]
    )  # fmt: skip
    metrics = [(row.metric, row.note) for row in out.rows if row.metric.startswith("x_")]
    how = "airground_no_such_module is not installed: pip install '.[baselines]'"
    assert metrics == [("x_missing", how)]
    assert [row.value for row in out.rows if row.metric == "y_claimed"] == [0.0]


def test_no_baselines_no_table() -> None:
    out = RowWriter("indoor_a", 0, 0, CONDITION)
    out.add("run", "recorded_s", 1.0, "s")
    assert baseline_table(ResultTable.from_rows(out.rows)).rows == ()


def test_trials_are_spread_evenly() -> None:
    assert trial_sightings(23, 12) == [0, 2, 4, 6, 8, 10, 12, 14, 16, 18, 20, 22]
    assert trial_sightings(3, 12) == [0, 1, 2]
    assert trial_sightings(0, 12) == []
    assert spread_evenly(12, 3) == [0, 6, 11]
    assert spread_evenly(12, 12) == list(range(12))


@pytest.mark.parametrize(
    ("words", "count"),
    [((), 12), (("--quick",), 0), (("--quick", "--set", "protocol.baselines=3"), 3)],
)
def test_reproduce_says_on_how_many_trials(words: tuple[str, ...], count: int) -> None:
    verb = parse("reproduce", ["--out", "x", *words])
    assert isinstance(verb, Reproduce)
    assert verb.plan().protocol.baselines == count


def test_the_twin_tries_the_baselines_that_match_images() -> None:
    verb = parse("reproduce", ["--out", "x", "--preset", "paper"])
    assert isinstance(verb, Reproduce)
    protocol = verb.plan().protocol
    assert protocol.baselines == 10
    names = [baseline.name for baseline in measure.baselines_asked(protocol)]
    assert names == ["sift", "asift", "xfeat", "disk"]
    assert measure.baselines_asked(Protocol()) == list(BASELINES)


@pytest.mark.parametrize(
    ("words", "only_images"),
    [
        (("--level", "paper"), True),
        (("--level", "paper", "--set", "protocol.only_images=false"), False),
        (("--level", "hard"), False),
        (("--level", "hard", "--set", "protocol.only_images=true"), True),
    ],
)
def test_which_baselines_are_tried_at_a_level(words: tuple[str, ...], only_images: bool) -> None:
    verb = parse("reproduce", ["--out", "x", *words])
    assert isinstance(verb, Reproduce)
    asked = measure.baselines_asked(verb.plan().protocol)
    assert ("ncc" not in [baseline.name for baseline in asked]) == only_images


def test_a_negative_number_of_trials_is_refused() -> None:
    verb = parse("reproduce", ["--out", "x", "--set", "protocol.baselines=-1"])
    assert isinstance(verb, Reproduce)
    with pytest.raises(InputError, match=r"protocol\.baselines = -1"):
        verb.plan()

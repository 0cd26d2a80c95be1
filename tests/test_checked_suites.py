"""A sample stands for the suites only where sources and results are those that passed whole."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from evaluation.commands.reproduce import Reproduce
from evaluation.commands.results import Check
from evaluation.judge.samples import Flight
from evaluation.measure.suite import SUITES
from evaluation.measure.work.code_version import code_version
from evaluation.table.rows import ResultTable
from tests import checked_suites
from tests.checked_suites import FILE, Checked, Digests, digests, keep, sample
from tests.evaluation.judge.flights import make_results

TABLE = make_results(range(3))


@pytest.fixture
def results(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A run of all suites by the present sources that got nothing worse."""
    for name in SUITES:
        for unit in range(4):
            made_from = tmp_path / "results" / name / "units" / str(unit) / "made_from.json"
            made_from.parent.mkdir(parents=True)
            made_from.write_text(json.dumps({"code": code_version()}))
    monkeypatch.setattr("evaluation.judge.results.read_table", lambda _: TABLE)
    monkeypatch.setattr(Check, "main", lambda _: 0)
    return tmp_path / "results"


def sampled_as(monkeypatch: pytest.MonkeyPatch, found: Digests) -> None:
    def measured(*_: object) -> Digests:
        return found

    monkeypatch.setattr(checked_suites, "measured_sample", measured)


def test_a_digest_tells_which_flight_gave_other_results() -> None:
    frame = TABLE.frame.copy()
    moved = (frame["metric"] == "mav_ate_se3_rmse_m") & (frame["seed"] == 1)
    assert moved.any()
    frame.loc[moved, "value"] *= 1.001
    before, after = digests(TABLE), digests(ResultTable(frame))
    assert before.keys() == after.keys()
    assert {flight for flight in before if before[flight] != after[flight]} == {"tiny/1/0"}


def test_a_flight_alone_has_the_digest_that_it_has_among_others() -> None:
    frame = TABLE.frame
    alone = digests(ResultTable(frame[(frame["scene"] == "tiny") & (frame["seed"] == 2)]))
    assert alone == {"tiny/2/0": digests(TABLE)["tiny/2/0"]}


def test_the_same_sources_and_results_pass(
    results: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    keep(results, tmp_path / "checked.json")
    sampled_as(monkeypatch, {"tiny/1/0": digests(TABLE)["tiny/1/0"]})
    assert sample(results, tmp_path / "checked.json") == ""


def test_other_results_of_the_same_sources_are_named(
    results: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    keep(results, tmp_path / "checked.json")
    sampled_as(monkeypatch, {"tiny/1/0": digests(TABLE)["tiny/1/0"], "tiny/2/0": "0"})
    reason = sample(results, tmp_path / "checked.json")
    assert reason == "suite fast: tiny/2/0 gave other results with the same sources"


def test_other_sources_are_not_sampled(
    results: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    Checked("0", {}).write(tmp_path / "checked.json")
    monkeypatch.delattr(checked_suites, "measured_sample")
    assert "sources that make results changed" in sample(results, tmp_path / "checked.json")


def test_results_of_other_sources_are_not_kept(results: Path, tmp_path: Path) -> None:
    (results / "hard/units/0/made_from.json").write_text('{"code": "0"}')
    with pytest.raises(SystemExit, match="hard: measured by other sources"):
        keep(results, tmp_path / "checked.json")
    assert not (tmp_path / "checked.json").exists()


def test_worse_results_are_not_kept(
    results: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(Check, "main", lambda check: int(check.results.name == "faults"))
    with pytest.raises(SystemExit, match="faults: something got worse"):
        keep(results, tmp_path / "checked.json")
    assert not (tmp_path / "checked.json").exists()


def test_every_flight_of_every_suite_was_checked(tmp_path: Path) -> None:
    checked = Checked.read(FILE).suites
    assert checked.keys() == SUITES.keys()
    for name in SUITES:
        flown = Reproduce(out=tmp_path, suite=name).suite_plan(name).flights
        named = {str(Flight(f.scene.name, f.seed, f.flight)) for f in flown}
        assert checked[name].keys() == named


def test_the_sample_is_of_the_flights_of_the_suite(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Two of them, others where the sources are others."""
    found = []
    for tree in ("a", "b", "b"):
        monkeypatch.setattr(checked_suites, "tree_digest", lambda tree=tree: tree)
        found.append(measured_of_fast(tmp_path, monkeypatch))
    assert [len(flights) for flights in found] == [2, 2, 2]
    assert found[0] != found[1] == found[2]


def measured_of_fast(out: Path, monkeypatch: pytest.MonkeyPatch) -> set[int]:
    """Seeds of the flights that are measured for a sample of suite fast."""
    seeds: set[int] = set()

    class Stop(Exception):
        pass

    def measure(units: list, *_: object) -> None:  # type: ignore[type-arg]
        seeds.update(unit.seed for unit in units)
        raise Stop

    monkeypatch.setattr("evaluation.measure.work.measure.measure", measure)
    plan = Reproduce(out=out / "fast", suite="fast").suite_plan("fast")
    with pytest.raises(Stop):
        checked_suites.measured_sample("fast", plan, out / "fast")
    return seeds

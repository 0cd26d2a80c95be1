"""A sample stands for the suites only where sources and results are those that passed whole."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

from airground.errors import InputError
from evaluation.commands.reproduce import Reproduce
from evaluation.judge.accepted import Measured
from evaluation.judge.samples import Flight
from evaluation.measure.suite import SUITES
from evaluation.measure.work.code_version import code_version
from evaluation.setup.console import EXIT_ERROR, EXIT_OK, EXIT_WORSE
from evaluation.table.rows import ResultTable
from tests.checked_suites import sample as sampling
from tests.checked_suites.figures import FILE, Checked, keep
from tests.checked_suites.sample import EXIT_RUN_WHOLE, sample
from tests.evaluation.judge.flights import make_results
from tests.evaluation.judge.test_history import accept, written
from tests.sources import ROOT

SEEDS = range(12)
TABLE = make_results(SEEDS)
WORSE = make_results(SEEDS, {"error_m": 3.0})


@pytest.fixture
def accepted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Accepted figures of all suites, and where they are."""
    monkeypatch.setattr("evaluation.commands.results.ACCEPTED", tmp_path / "accepted.json")
    accept_all(tmp_path, TABLE)
    return tmp_path


def accept_all(folder: Path, table: ResultTable) -> None:
    for name in ("accepted", "accepted_hard", "accepted_faults"):
        accept(folder / f"{name}.json", Measured.of(table), "1a2b3c4", "right")


@pytest.fixture
def results(accepted: Path) -> Path:
    """A run of all suites by the present sources."""
    for name in SUITES:
        folder = written(TABLE, accepted / "results" / name)
        for unit in range(len(SEEDS) + 1):
            made_from = folder / "units" / str(unit) / "made_from.json"
            made_from.parent.mkdir(parents=True)
            made_from.write_text(json.dumps({"code": code_version()}))
    return accepted / "results"


def sampled_as(monkeypatch: pytest.MonkeyPatch, seed: int, table: ResultTable) -> None:
    """Measuring gives what the table has of one flight."""
    one = Flight("tiny", seed, 0)

    def measured(*_: object) -> Measured:
        return Measured.of(table).only({one})

    monkeypatch.setattr(sampling, "measured_sample", measured)


def test_the_same_sources_and_results_pass(results: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = results / "checked.json"
    assert keep(results, file) == EXIT_OK
    sampled_as(monkeypatch, 1, TABLE)
    assert sample(results, file) == EXIT_OK


def test_other_results_of_the_same_sources_are_named(
    results: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """A change in the third digit of one metric of one flight is seen."""
    keep(results, results / "checked.json")
    frame = TABLE.frame.copy()
    moved = (frame["metric"] == "mav_ate_se3_rmse_m") & (frame["seed"] == 2)
    frame.loc[moved, "value"] *= 1.001
    sampled_as(monkeypatch, 2, ResultTable(frame))
    assert sample(results, results / "checked.json") == EXIT_RUN_WHOLE
    assert "suite fast: tiny/2/0 gave other results" in capsys.readouterr().out
    sampled_as(monkeypatch, 3, ResultTable(frame))
    assert sample(results, results / "checked.json") == EXIT_OK


def test_on_another_machine_other_digits_pass_and_a_fault_does_not(
    results: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    file = results / "checked.json"
    keep(results, file)
    frame = TABLE.frame.copy()
    frame.loc[frame["metric"] == "mav_ate_se3_rmse_m", "value"] *= 1.001
    sampled_as(monkeypatch, 2, ResultTable(frame))
    assert sample(results, file) == EXIT_RUN_WHOLE
    monkeypatch.setattr(sampling, "machine", lambda: "another")
    assert sample(results, file) == EXIT_OK
    sampled_as(monkeypatch, 2, WORSE)
    assert sample(results, file) == EXIT_RUN_WHOLE
    assert "suite fast: tiny/2/0 gave worse results" in capsys.readouterr().out


def test_figures_are_held_against_what_is_accepted_now(
    results: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Better figures were accepted after the suites had passed: the same results are worse now."""
    keep(results, results / "checked.json")
    accept_all(results.parent, make_results(SEEDS, {"error_m": 0.3}))
    monkeypatch.delattr(sampling, "measured_sample")
    assert sample(results, results / "checked.json") == EXIT_WORSE
    assert "suite fast: localization_1, " in capsys.readouterr().out


def test_other_sources_are_not_sampled(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    Checked(code="0", machine="0", suites={}).write(tmp_path / "checked.json")
    monkeypatch.delattr(sampling, "measured_sample")
    assert sample(tmp_path, tmp_path / "checked.json") == EXIT_RUN_WHOLE
    assert "sources that make results changed" in capsys.readouterr().out


def test_a_new_suite_or_metric_is_not_sampled(
    results: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    file = results / "checked.json"
    keep(results, file)
    monkeypatch.delattr(sampling, "measured_sample")
    whole = json.loads(file.read_text())
    for part, name in ((whole["suites"]["hard"]["metrics"], "located"), (whole["suites"], "hard")):
        del part[name]
        file.write_text(json.dumps(whole))
        assert sample(results, file) == EXIT_RUN_WHOLE
        assert f"'{name}'" in capsys.readouterr().out


def test_results_of_other_sources_are_not_kept(results: Path) -> None:
    (results / "hard/units/0/made_from.json").write_text('{"code": "0"}')
    with pytest.raises(InputError, match="hard: measured by other sources"):
        keep(results, results / "checked.json")
    assert not (results / "checked.json").exists()


def test_worse_results_are_not_kept(results: Path) -> None:
    WORSE.write(results / "faults/results.parquet")
    assert keep(results, results / "checked.json") == EXIT_WORSE
    assert not (results / "checked.json").exists()


@pytest.mark.parametrize("words", [(), ("keep",), ("sampel", "results"), ("keep", "nowhere")])
def test_a_wrong_word_or_folder_is_an_error_and_no_verdict(words: tuple[str, ...]) -> None:
    command = [sys.executable, "-m", "tests.checked_suites", *words]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == EXIT_ERROR
    assert done.stderr.count("\n") == 1


def test_every_flight_of_every_suite_was_checked(tmp_path: Path) -> None:
    checked = Checked.read(FILE).suites
    assert checked.keys() == SUITES.keys()
    for name in SUITES:
        flown = Reproduce(out=tmp_path, suite=name).suite_plan(name).flights
        named = {Flight(f.scene.name, f.seed, f.flight) for f in flown}
        assert set(checked[name].flights) == named


def test_the_sample_is_of_the_flights_of_the_suite(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Two of them, others where the sources are others."""
    found = []
    for tree in ("a", "b", "b"):
        monkeypatch.setattr(sampling, "tree_digest", lambda tree=tree: tree)
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

    monkeypatch.setattr(sampling, "measure", measure)
    plan = Reproduce(out=out / "fast", suite="fast").suite_plan("fast")
    with pytest.raises(Stop):
        sampling.measured_sample("fast", plan, out / "fast")
    return seeds

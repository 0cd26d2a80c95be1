"""`airground check` and `airground accept` as a user and a CI meet them."""

from __future__ import annotations

import io
import json
from pathlib import Path
from xml.etree import ElementTree

import pytest
from rich.console import Console

from evaluation import cli
from evaluation.commands import results as commands
from evaluation.judge.accepted import Measured
from evaluation.judge.metrics import WATCHED
from evaluation.judge.summary import build_summary
from evaluation.judge.verdict import Verdict, compare
from evaluation.setup import console
from evaluation.setup.condition import RunInfo
from evaluation.show.comparison.verdict_json import as_json, badge, outcome
from evaluation.show.comparison.verdict_table import HEADER, cells, markdown, print_comparison
from evaluation.table.rows import ResultTable
from tests.evaluation.judge.flights import make_results, measured

SEEDS = range(10)


def exit_code(*words: object) -> object:
    with pytest.raises(SystemExit) as exit_:
        cli.main([str(word) for word in words])
    return exit_.value.code


def one_error_line(capsys: pytest.CaptureFixture[str]) -> str:
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("airground: error: ")
    return line


def write(table: ResultTable, folder: Path) -> Path:
    """What check and accept read of a run's folder."""
    folder.mkdir()
    table.write(folder / "results.parquet")
    run = RunInfo("0.1.0", "abc123", 0, "some CPU", 2)
    build_summary(table, table.conditions()[0], run).write(folder / "summary.json")
    return folder


@pytest.fixture
def accepted(tmp_path: Path) -> Path:
    path = tmp_path / "accepted.json"
    results = write(make_results(SEEDS), tmp_path / "accepted")
    assert exit_code("accept", results, "--reason", "first figures", "--to", path) == 0
    return path


def test_the_same_results_pass(accepted: Path, capsys: pytest.CaptureFixture[str]) -> None:
    results = accepted.with_name("accepted")
    assert exit_code("check", results, "--against", accepted) == console.EXIT_OK
    assert "No difference seen" in capsys.readouterr().out


def test_a_suite_is_held_against_its_own_figures(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(commands, "ACCEPTED", tmp_path / "accepted.json")
    frames = {"fast": make_results(SEEDS).frame, "hard": make_results(SEEDS).frame}
    frames["hard"]["variant"] = "suite hard"
    runs = {name: write(ResultTable(frame), tmp_path / name) for name, frame in frames.items()}
    for name, run in runs.items():
        assert exit_code("accept", run, "--reason", f"first figures of {name}") == 0
    kept = {"accepted.json": "", "accepted_hard.json": "suite hard"}
    for name, variant in kept.items():
        assert json.loads((tmp_path / name).read_text())["condition"]["variant"] == variant
    frames["hard"].loc[frames["hard"]["metric"] == "error_median_m", "value"] *= 1.4
    worse = write(ResultTable(frames["hard"]), tmp_path / "worse")
    capsys.readouterr()
    assert [exit_code("check", run) for run in (*runs.values(), worse)] == [0, 0, 1]


def test_worse_results_fail_and_are_reported_in_three_forms(accepted: Path, tmp_path: Path) -> None:
    results = write(make_results(SEEDS, {"error_median_m": 1.4}), tmp_path / "worse")
    pull, xml = tmp_path / "check.md", tmp_path / "check.xml"
    words = ("check", results, "--against", accepted, "--markdown", pull, "--junit", xml)
    assert exit_code(*words) == 1
    assert "1 worse: surface, median error" in pull.read_text()

    suite = ElementTree.parse(xml).getroot().find("testsuite")
    assert suite is not None
    cases = suite.findall("testcase")
    assert [case.get("name") for case in cases] == [metric.name for metric in WATCHED]
    failed = [case.get("name") for case in cases if case.find("failure") is not None]
    assert failed == ["surface_median"]
    assert (suite.get("tests"), suite.get("failures")) == (str(len(WATCHED)), "1")


def test_programs_read_what_the_screen_shows(accepted: Path, tmp_path: Path) -> None:
    results = write(make_results(SEEDS, {"error_median_m": 1.4}), tmp_path / "worse")
    made, shield = tmp_path / "check.json", tmp_path / "badge.json"
    words = ("check", results, "--against", accepted, "--json", made, "--badge", shield)
    assert exit_code(*words) == console.EXIT_WORSE
    read = json.loads(made.read_text())
    assert (read["verdict"], read["conclusion"]) == ("worse", "1 worse: surface, median error")
    assert [one["name"] for one in read["metrics"]] == [metric.name for metric in WATCHED]
    (moved,) = [one for one in read["metrics"] if one["name"] == "surface_median"]
    assert moved["change"] == pytest.approx(moved["now"] - moved["accepted"], rel=0.1)
    assert 0 < moved["low"] <= moved["change"] <= moved["high"]
    assert moved["p"] <= read["alpha"]
    assert moved["shown"]["verdict"] == moved["verdict"] == "worse"
    assert json.loads(shield.read_text()) == {
        "schemaVersion": 1,
        "label": "accuracy",
        "message": "1 worse",
        "color": "red",
    }


@pytest.mark.parametrize(
    ("factor", "word", "colour"),
    [(1.4, "worse", "red"), (0.7, "better", "brightgreen"), (1.0, "no difference seen", "green")],
)
def test_one_word_sums_up_all_metrics(factor: float, word: str, colour: str) -> None:
    comparison = compare(measured(SEEDS), measured(SEEDS, {"error_median_m": factor}))
    assert outcome(comparison) == word
    assert json.loads(badge(comparison))["color"] == colour


def test_failures_are_null_in_json_and_words_beside_it() -> None:
    failed = measured(SEEDS, {"error_median_m": float("inf")})
    read = json.loads(as_json(compare(measured(SEEDS), failed)))
    (moved,) = [one for one in read["metrics"] if one["name"] == "surface_median"]
    assert (moved["now"], moved["change"]) == (None, None)
    assert (moved["shown"]["now"], moved["shown"]["change"]) == ("failed", "fails")


def test_one_observation_has_values_and_no_interval_in_json() -> None:
    single = Measured.of(one_recording(0))
    comparison = compare(single, single)
    names = {judged.metric.name for judged in comparison.of(Verdict.SINGLE)}
    assert names
    for one in json.loads(as_json(comparison))["metrics"]:
        if one["name"] in names:
            assert one["now"] is not None
            assert (one["low"], one["high"], one["p"]) == (None, None, None)


def test_better_results_pass(accepted: Path, tmp_path: Path) -> None:
    results = write(make_results(SEEDS, {"error_median_m": 0.7}), tmp_path / "better")
    assert exit_code("check", results, "--against", accepted) == console.EXIT_OK


def test_results_can_be_held_against_other_results(accepted: Path, tmp_path: Path) -> None:
    results = write(make_results(SEEDS, {"error_median_m": 1.4}), tmp_path / "worse")
    before = accepted.with_name("accepted")
    assert exit_code("check", results, "--against", before) == 1
    assert exit_code("check", before, "--against", results) == 0


def one_recording(seed: int, changes: dict[str, float] | None = None) -> ResultTable:
    """What `run` leaves of one recording: one sequence, one trial, no control scene."""
    frame = make_results([seed], changes).frame
    first = (frame["sequence"].fillna(0) == 0) & (frame["trial"].fillna(0) == 0)
    return ResultTable(frame[(frame["scene"] == "tiny") & first])


@pytest.mark.parametrize("other_seed", [0, 1])
def test_one_observation_gives_both_values_and_no_verdict(
    other_seed: int, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    before = write(one_recording(0), tmp_path / "before")
    after = write(one_recording(other_seed, {"error_median_m": 3.0}), tmp_path / "after")
    pull, xml = tmp_path / "check.md", tmp_path / "check.xml"
    words = ("check", after, "--against", before, "--markdown", pull, "--junit", xml)
    assert exit_code(*words) == console.EXIT_OK
    assert "no verdict possible" in capsys.readouterr().out
    (row,) = [line for line in pull.read_text().splitlines() if "surface, median error" in line]
    cells = [cell.strip() for cell in row.split("|")[1:-1]]
    assert cells[1].endswith(" mm")
    assert cells[2].endswith(" mm")
    assert cells[1] != cells[2]
    assert cells[4:6] == ["-", "-"]
    assert cells[-1] == "one observation: no verdict possible"
    suite = ElementTree.parse(xml).getroot().find("testsuite")
    assert suite is not None
    (case,) = [case for case in suite if case.get("name") == "surface_median"]
    assert case.find("skipped") is not None
    assert suite.get("failures") == "0"


def test_no_observation_at_all_is_no_verdict(tmp_path: Path) -> None:
    frame = make_results([0]).frame
    empty = ResultTable(frame[(frame["stage"] == "run") | (frame["metric"] == "lead")])
    nothing = write(empty, tmp_path / "nothing")
    assert exit_code("check", nothing, "--against", nothing) == console.EXIT_OK


def test_one_flight_of_many_trials_still_has_a_verdict(tmp_path: Path) -> None:
    before = write(make_results([0]), tmp_path / "before")
    after = write(make_results([0], {"error_median_m": 3.0}), tmp_path / "after")
    assert exit_code("check", after, "--against", before) == console.EXIT_OK


def test_what_cannot_be_compared_is_one_line(
    accepted: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    few = write(make_results(range(3)), tmp_path / "few")
    frame = make_results(SEEDS).frame.assign(preset="paper")
    paper = write(ResultTable(frame), tmp_path / "paper")
    capsys.readouterr()
    for results, complaint in (
        (few, "expected flat x 1, tiny x 10"),
        (paper, "nothing was measured with preset best"),
        (tmp_path / "nowhere", "no such folder"),
    ):
        assert exit_code("check", results, "--against", accepted) == console.EXIT_ERROR
        assert complaint in one_error_line(capsys)


def test_results_of_other_flights_hint_at_what_is_asked(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    few = write(make_results(range(3)), tmp_path / "few")
    capsys.readouterr()
    assert exit_code("check", few) == console.EXIT_ERROR
    assert "--against names others" in one_error_line(capsys)


def test_accepting_without_a_reason_changes_nothing(
    accepted: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    before = accepted.read_bytes()
    capsys.readouterr()
    results = accepted.with_name("accepted")
    assert exit_code("accept", results, "--reason", " ", "--to", accepted) == console.EXIT_ERROR
    assert "--reason" in one_error_line(capsys)
    assert accepted.read_bytes() == before


@pytest.mark.parametrize(
    ("word", "complaint"),
    [
        ("--quick", "--suite and --quick are not allowed together"),
        ("--set protocol.trials=3", "the suite fast is fixed"),
        ("--scenes tiny", "the suite fast is fixed"),
        ("--alone", "--alone: the suite fast has one setup anyway"),
    ],
)
def test_the_suite_is_fixed(
    word: str, complaint: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ("reproduce", "--suite", "fast", *word.split(), "--out", tmp_path / "out")
    assert exit_code(*words) == console.EXIT_ERROR
    assert complaint in one_error_line(capsys)


def test_markdown_is_a_table_of_every_metric() -> None:
    comparison = compare(measured(SEEDS), measured(SEEDS, {"error_median_m": 1.4}))
    lines = [line for line in markdown(comparison).splitlines() if line.startswith("|")]
    assert len(lines) == len(WATCHED) + 2 * 2
    assert {line.count("|") for line in lines} == {len(HEADER) + 1}


@pytest.mark.parametrize("width", [80, 140])
def test_the_screens_table_fits(width: int) -> None:
    comparison = compare(measured(SEEDS), measured(SEEDS, {"error_median_m": 1.4}))
    screen = Console(width=width, record=True, file=io.StringIO())
    print_comparison(comparison, screen)
    rows = screen.export_text().splitlines()
    for judged in comparison.judged:
        row = cells(judged)
        assert any(row[0] in line and row[-1] in line for line in rows), row

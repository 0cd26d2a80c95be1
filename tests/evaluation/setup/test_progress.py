"""Progress as a command shows it: silent for libraries, plain lines in a file."""

from __future__ import annotations

import time

import pytest

from evaluation.setup import progress
from evaluation.setup.progress import Step, announce, clock, roughly, shown, step


def test_without_a_command_nothing_is_shown(capsys: pytest.CaptureFixture[str]) -> None:
    announce("measures 3 units", 60.0)
    with step("measuring", 3, "units") as measuring:
        assert list(measuring.along("abc")) == ["a", "b", "c"]
    assert measuring.done == 3
    assert capsys.readouterr().err == ""


def test_a_file_gets_a_line_while_one_unit_runs_and_one_at_the_end(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    assert progress.PLAIN_INTERVAL_S < 15
    monkeypatch.setattr(progress, "PLAIN_INTERVAL_S", 0.05)
    with shown():
        announce("measures 3 units", 150.0)
        with step("measuring", 3, "units", done=1) as measuring:
            time.sleep(0.12)  # no unit is done in the meantime
            measuring.advance(2)
    first, *between, last = capsys.readouterr().err.splitlines()
    assert first == "measures 3 units; takes about 2 min"
    assert between[0] == "measuring: 1/3 units, elapsed 0:00, left about 2:30"
    assert last == "measuring: 3/3 units, elapsed 0:00, left about 0:00"


def test_a_short_step_is_not_mentioned(capsys: pytest.CaptureFixture[str]) -> None:
    with shown(), step("drawing"):
        pass
    assert capsys.readouterr().err == ""


def test_what_was_expected_of_the_command_says_nothing_of_the_last_step() -> None:
    with shown():
        announce("measures 3 units", 150.0)
        with step("starting") as starting:
            assert starting.left_s == pytest.approx(150.0, abs=1.0)
        with step("measuring", 3, "units") as measuring:
            assert measuring.left_s == pytest.approx(150.0, abs=1.0)
            measuring.advance(3)
        with step("writing the report") as writing:
            assert writing.left_s is None
    with shown():
        announce("measures 3 units", 150.0)
        with step("starting") as starting:
            assert starting.left_s is not None


def test_the_time_left_comes_from_the_rate(monkeypatch: pytest.MonkeyPatch) -> None:
    now = 100.0
    monkeypatch.setattr("time.monotonic", lambda: now)
    monkeypatch.setattr(progress, "_due", 130.0)  # as announced
    running = Step("running", 10, "images", done=4)
    now = 110.0
    assert running.left_s == 20.0
    running.advance()
    assert running.left_s == 50.0
    running.say("the last of them")
    assert running.line() == "running: the last of them, 5/10 images, elapsed 0:10, left about 0:50"
    running.move_to(5, 20)
    assert running.left_s == 150.0
    running.next("one part")
    running.next("another")
    assert running.done == 6
    now = 140.0
    unknown = Step("compiling")
    assert unknown.left_s is None
    assert unknown.line() == "compiling: elapsed 0:00"


def test_durations_are_written_for_people() -> None:
    assert [clock(s) for s in (7.4, 750, 11100)] == ["0:07", "12:30", "3:05:00"]
    said = [roughly(s) for s in (4, 44, 200, 9000)]
    assert said == ["some seconds", "about 40 s", "about 3 min", "about 2 h"]

"""The fast suite: which flights, in which order; and that it can say something."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import pytest

from airground.config import Config
from evaluation.comparison import least_paired_p
from evaluation.experiment import Outcome
from evaluation.regression import suite
from evaluation.regression.metrics import WATCHED
from evaluation.regression.suite import SUITES, Flown, fly, run_suite
from evaluation.regression.verdict import ALPHA
from evaluation.results import CONTROL_SCENES, Row
from evaluation.setups import Setup
from tests.evaluation.regression.flights import CONDITION


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch) -> list[Flown]:
    """What would have been flown."""
    seen: list[Flown] = []

    def outcomes(
        function: Callable[[Flown], Outcome], tasks: Sequence[Flown], workers: int
    ) -> Iterator[Outcome]:
        assert function is fly
        for task in tasks:
            seen.append(task)
            row = Row(task.scene, task.seed, 0, CONDITION, "run", "recorded_s", 20.0, "s")
            yield Outcome([[row]], None)

    monkeypatch.setattr(suite, "outcomes", outcomes)
    return seen


def test_every_flight_has_a_heap_and_a_recording_of_its_own(
    asked: list[Flown], tmp_path: Path
) -> None:
    for seed in (0, 1):
        run_suite(SUITES["fast"], Setup(Config()), "nominal", seed, tmp_path, 1)
    heaps = {(flown.scene, flown.seed) for flown in asked}
    recordings = {flown.recording for flown in asked}
    assert len(heaps) == len(recordings) == len(asked)
    assert [flown.showcase for flown in asked].count(True) == 2


def test_rows_keep_the_order_of_the_flights(asked: list[Flown], tmp_path: Path) -> None:
    table = run_suite(SUITES["fast"], Setup(Config()), "nominal", 3, tmp_path, 1).table
    assert table.frame["seed"].tolist() == [flown.seed for flown in asked]


@pytest.mark.parametrize("name", SUITES)
def test_a_suite_can_say_something_and_has_a_control(name: str) -> None:
    counts = {flights.scene: flights.count for flights in SUITES[name].flights}
    ordinary = sum(count for scene, count in counts.items() if scene not in CONTROL_SCENES)
    assert least_paired_p(ordinary) * len(WATCHED) <= ALPHA
    assert CONTROL_SCENES & counts.keys()


@pytest.mark.slow
def test_a_flight_is_recorded_once_and_measured_alike(tmp_path: Path) -> None:
    protocol = SUITES["fast"].protocol
    flown = Flown(
        "tiny", 0, 16.0, "none", tmp_path / "tiny", Setup(Config(), "oracle"), protocol, False
    )
    first = fly(flown).rows
    made = (tmp_path / "tiny" / "recording.toml").stat().st_mtime_ns
    again = fly(flown).rows
    assert (tmp_path / "tiny" / "recording.toml").stat().st_mtime_ns == made
    values = [
        [(row.metric, row.value) for row in rows if row.stage in ("surface", "localization")]
        for rows in (first, again)
    ]
    assert values[0]
    assert repr(values[0]) == repr(values[1])

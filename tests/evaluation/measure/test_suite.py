"""The fast suite: its flights, their order, and its control."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import pytest

from airground.config import Config
from evaluation.judge.metrics import WATCHED
from evaluation.judge.verdict import ALPHA
from evaluation.measure.plans import reproduce
from evaluation.measure.plans.reproduce import Plan
from evaluation.measure.plans.suite import SUITES, Flights, Suite
from evaluation.measure.protocol.trials import Protocol
from evaluation.measure.work.crew import Crew
from evaluation.measure.work.measure import recording_name
from evaluation.measure.work.out_folder import resumable_folder
from evaluation.measure.work.unit import Finished, Unit, UnitStore
from evaluation.setup.setups import Setup
from evaluation.table.comparison import least_paired_p
from evaluation.table.rows import CONTROL_SCENES, ResultTable, Row
from sim.sensors.presets import NOMINAL, NONE
from tests.evaluation.judge.flights import CONDITION


def plan(seed: int) -> Plan:
    return SUITES["fast"].plan(Setup(Config()), NOMINAL, seed)


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch) -> list[Unit]:
    """What would have been measured."""
    seen: list[Unit] = []

    def measure(units: Sequence[Unit], store: UnitStore, crew: Crew) -> list[Finished]:
        seen.extend(units)
        rows = [Row("tiny", u.seed, 0, CONDITION, "run", "recorded_s", 20.0, "s") for u in units]
        return [Finished(ResultTable.from_rows([row]), None) for row in rows]

    monkeypatch.setattr(reproduce, "measure", measure)
    return seen


def test_every_flight_has_a_heap_and_a_recording_of_its_own() -> None:
    flights = [flight for seed in (0, 1) for flight in plan(seed).flights]
    assert len({(flight.scene.name, flight.seed) for flight in flights}) == len(flights)
    assert len({recording_name(flight) for flight in flights}) == len(flights)
    assert len(flights) == 2 * plan(0).tasks()


def test_rows_keep_the_order_of_the_flights(asked: list[Unit], tmp_path: Path) -> None:
    crew = Crew(None, 1, 1, tmp_path)
    found = plan(3).measured(None, UnitStore(tmp_path / "units"), crew)
    assert found.table.frame["seed"].tolist() == [flight.seed for flight in plan(3).flights]
    assert [unit.showcase for unit in asked] == [True] + [False] * (len(asked) - 1)


@pytest.mark.parametrize("name", SUITES)
def test_a_suite_can_say_something_and_has_a_control(name: str) -> None:
    counts = {flights.scene: flights.count for flights in SUITES[name].flights}
    ordinary = sum(count for scene, count in counts.items() if scene not in CONTROL_SCENES)
    assert least_paired_p(ordinary) * len(WATCHED) <= ALPHA
    assert CONTROL_SCENES & counts.keys()


@pytest.mark.slow(minutes=1)
@pytest.mark.subject(but={"airground/slam": "poses are the true ones"})
def test_a_flight_is_recorded_once_and_measured_alike(tmp_path: Path) -> None:
    one = Suite((Flights("tiny", 1, 16.0),), Protocol(sequences=1, trials=2, sequence_length=4))
    flown = one.plan(Setup(Config(), "oracle"), NONE, 0)
    header = tmp_path / "recordings" / recording_name(flown.flights[0]) / "recording.toml"
    values, times = [], []
    for out in ("first", "again"):
        with (
            resumable_folder(tmp_path / out) as folder,
            Crew(None, 2, flown.tasks(), folder.scratch) as crew,
        ):
            found = flown.measured(tmp_path / "recordings", folder.store, crew)
        frame = found.table.frame
        kept = frame[frame["stage"].isin(["surface", "localization"])]
        values.append(kept["value"].tolist())
        times.append(header.stat().st_mtime_ns)
    assert values[0]
    assert repr(values[0]) == repr(values[1])
    assert times[0] == times[1]

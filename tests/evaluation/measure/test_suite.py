"""The suites: their flights, the order of these, and their controls."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path

import pytest

from airground.config import Config
from evaluation.judge.metrics import WATCHED
from evaluation.judge.verdict import ALPHA
from evaluation.measure.levels.level import load_level
from evaluation.measure.plans import reproduce
from evaluation.measure.plans.reproduce import Plan
from evaluation.measure.protocol.trials import Protocol
from evaluation.measure.suite import SUITES, Flights, Suite, SuiteName
from evaluation.measure.work.crew import Crew
from evaluation.measure.work.measure import recording_name
from evaluation.measure.work.out_folder import resumable_folder
from evaluation.measure.work.unit import Finished, Unit, UnitStore
from evaluation.setup.setups import Setup
from evaluation.table.comparison import least_paired_p
from evaluation.table.rows import CONTROL_SCENES, ResultTable, Row
from sim.recording.recorder import Flight
from sim.scene import load_scene
from sim.sensors.presets import NONE, sensor_preset
from tests.evaluation.judge.flights import CONDITION


def plan(seed: int, name: SuiteName = "fast") -> Plan:
    return SUITES[name].plan(
        Setup(Config()), sensor_preset(SUITES[name].sensors or "nominal"), seed
    )


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch) -> list[Unit]:
    """What would have been measured."""
    seen: list[Unit] = []

    def measure(
        units: Sequence[Unit], store: UnitStore, crew: Crew, flights: Mapping[Path, Flight]
    ) -> list[Finished]:
        seen.extend(units)
        rows = [Row("tiny", u.seed, 0, CONDITION, "run", "recorded_s", 20.0, "s") for u in units]
        return [Finished(ResultTable.from_rows([row]), None) for row in rows]

    monkeypatch.setattr(reproduce, "measure", measure)
    return seen


@pytest.mark.parametrize("name", SUITES)
def test_every_flight_has_a_heap_and_a_recording_of_its_own(name: SuiteName) -> None:
    flights = [flight for seed in (0, 1) for flight in plan(seed, name).flights]
    assert len({(flight.scene.name, flight.seed) for flight in flights}) == len(flights)
    assert len({recording_name(flight) for flight in flights}) == len(flights)
    assert len(flights) == 2 * plan(0, name).tasks()


def test_no_two_suites_share_a_recording_or_a_condition() -> None:
    flights = [flight for name in SUITES for flight in plan(0, name).flights]
    assert len({recording_name(flight) for flight in flights}) == len(flights)
    conditions = {plan(0, name).setups[0].condition(NONE.name) for name in SUITES}
    assert len(conditions) == len(SUITES)


def test_the_hard_suite_turns_what_the_level_turns() -> None:
    level, suite = load_level("hard"), SUITES["hard"]
    assert (suite.sensors, suite.heading) == (level.sensors, level.heading)
    turned = {name for scene in map(load_scene, level.scenes) for name in level.point(scene)}
    for flight in plan(0, "hard").flights:
        control = flight.scene.name in CONTROL_SCENES
        assert set(flight.dials or {}) == (set() if control else turned)
        assert (flight.scene.ground.stop_at_overlap is None) == control
        assert (flight.scene.flight_light is None) == control


def test_each_flight_with_faults_has_one_of_its_own() -> None:
    found = [flight.sensors.faults for flight in plan(0, "faults").flights]
    assert all(found)
    ordinary = [
        faults
        for faults, flight in zip(found, plan(0, "faults").flights, strict=True)
        if flight.scene.name not in CONTROL_SCENES
    ]
    assert len(set(ordinary)) == len(ordinary)
    assert all(len({fault.kind for fault in faults}) == 1 for faults in ordinary)


def test_rows_keep_the_order_of_the_flights(asked: list[Unit], tmp_path: Path) -> None:
    crew = Crew(None, 1, 1, tmp_path)
    found = plan(3).measured(None, UnitStore(tmp_path / "units"), crew)
    assert found.table.frame["seed"].tolist() == [flight.seed for flight in plan(3).flights]
    assert [unit.showcase for unit in asked] == [True] + [False] * (len(asked) - 1)


@pytest.mark.parametrize("name", SUITES)
def test_a_suite_can_say_something_and_has_a_control(name: SuiteName) -> None:
    counts = Counter(flight.scene.name for flight in plan(0, name).flights)
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

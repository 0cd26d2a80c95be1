"""Flights of the protocol: as many as the requested sequences need."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import islice
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from airground.config import Config
from evaluation.commands.options import RENDER_S_PER_S
from evaluation.commands.reproduce import Reproduce
from evaluation.measure.plans import reproduce as module
from evaluation.measure.plans.reproduce import Plan, flights_over
from evaluation.measure.protocol.trials import Protocol
from evaluation.measure.work.crew import Crew
from evaluation.measure.work.measure import recording_name
from evaluation.measure.work.unit import Finished, Unit, UnitStore
from evaluation.setup import published
from evaluation.setup.setups import Setup, with_companions
from evaluation.table.rows import UNSCORED_SCENES, ResultTable, Row
from sim.recording.recorder import Flight
from sim.scene import load_scene
from sim.sensors.presets import NOMINAL

A_FLIGHT = 7


def sequences_of(unit: Unit) -> int:
    """Made up: some flights give fewer sequences than were asked for, none gives none."""
    return 1 + hash((unit.seed, unit.flight)) % A_FLIGHT


def flown_for(
    wanted: int, scenes: tuple[str, ...], flights: int, setups: int = 1
) -> tuple[list[tuple[str, int, int]], int]:
    """(scene, seed, flight) of what is flown for so many sequences, and how many those give."""
    flown: list[tuple[str, int, int]] = []

    def measure(
        units: Sequence[Unit], store: UnitStore, crew: Crew, flights: Mapping[Path, Flight]
    ) -> list[Finished]:
        finished = []
        for unit in units:
            scene = unit.recording.scene.name  # type: ignore[union-attr]
            if (scene, unit.seed, unit.flight) not in flown:
                flown.append((scene, unit.seed, unit.flight))
            condition = unit.setup.condition("nominal")
            rows = [
                Row(
                    scene, unit.seed, unit.flight, condition, "localization", "error_m", 0.1, "m",
                    sequence=sequence, iteration=1,
                )
                for sequence in range(sequences_of(unit))
            ]  # fmt: skip
            finished.append(Finished(ResultTable.from_rows(rows), None))
        return finished

    plan = Plan(
        flights_over([load_scene(scene) for scene in scenes], flights, NOMINAL, seed=5),
        with_companions(Setup(Config()))[:setups],
        Protocol(A_FLIGHT),
        sequences=wanted,
    )
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(module, "measure", measure)
        found = plan.measured(None, None, None)  # type: ignore[arg-type]
    frame = found.table.of(found.table.conditions()[0]).scored().sequences("error_m")
    return flown, len(frame)


def test_without_a_number_every_flight_is_flown_once() -> None:
    flown, _ = flown_for(0, ("tiny", "flat"), 2)
    assert flown == [("tiny", 5, 0), ("tiny", 5, 1), ("flat", 5, 0), ("flat", 5, 1)]


@settings(max_examples=15, deadline=None)
@given(st.integers(1, 60), st.integers(1, 3))
def test_flights_follow_by_seed_until_there_are_enough(wanted: int, flights: int) -> None:
    flown, found = flown_for(wanted, ("tiny", "indoor_a", "flat"), flights)
    assert found >= wanted
    more, _ = flown_for(wanted + 20, ("tiny", "indoor_a", "flat"), flights)
    assert more[: len(flown)] == flown  # more sequences only add flights
    assert [scene for scene, seed, _ in flown if seed > 5].count("flat") == 0
    if len(flown) > 3 * flights:
        # The last flight was needed: without it there are too few.
        fewer = [key for key in flown[:-1] if key[0] != "flat"]
        assert sum(1 + hash((seed, k)) % A_FLIGHT for _, seed, k in fewer) < wanted


def test_only_the_primary_setups_sequences_count() -> None:
    assert flown_for(30, ("tiny",), 1, setups=3)[0] == flown_for(30, ("tiny",), 1)[0]


def test_control_scenes_alone_give_no_sequences() -> None:
    assert len(flown_for(30, ("flat",), 2)[0]) == 2


def test_flights_that_follow_measure_what_shares_the_primary_setups_maps() -> None:
    setups = with_companions(Setup(Config()))
    plan = Plan(
        flights_over([load_scene("tiny")], 1, NOMINAL, 5), setups, Protocol(), sequences=100
    )
    assert [unit.setup for unit in plan.units(plan.flights[0])] == setups
    measured = [unit.setup for unit in plan.units(next(plan.further_flights()))]
    assert [setup.config.localization.heading for setup in measured] == ["known", "search"]
    assert measured[0] == setups[0]
    assert {setup.poses for setup in measured} == {"slam"}


def plan_of(*scenes: str, flights: int = 2) -> Plan:
    setups = with_companions(Setup(Config()))[:2]
    flown = flights_over([load_scene(name) for name in scenes], flights, NOMINAL, 5)
    return Plan(flown, setups, Protocol())


def test_the_wrong_map_is_that_of_the_same_flight_over_the_next_scene() -> None:
    plan = plan_of("indoor_a", "flat", "indoor_b", "tiny")
    strangers = {}
    for flight in plan.flights:
        if flight.scene.name != "flat":
            stranger = plan.stranger(flight)
            assert stranger is not None
            assert (stranger.seed, stranger.flight) == (5, flight.flight)
            strangers[flight.scene.name] = stranger.scene.name
    assert strangers == {"indoor_a": "indoor_b", "indoor_b": "tiny", "tiny": "indoor_a"}
    alone = plan_of("tiny", "flat")
    assert alone.stranger(alone.flights[0]) is None


def test_negatives_are_tried_on_the_primary_setup_of_flights_with_something_to_find() -> None:
    plan = plan_of("tiny", "indoor_a", "flat", flights=1)
    tiny, indoor, flat = plan.flights
    recordings = {recording_name(indoor): Path("there")}
    primary, companion = plan.units(tiny, recordings)
    assert (primary.recording, primary.negatives, primary.stranger) == (tiny, True, Path("there"))
    assert (companion.negatives, companion.stranger) == (False, None)
    assert plan.units(indoor, recordings)[0].stranger == tiny
    further = next(plan.further_flights())
    for flight in (flat, further):
        found = {(unit.negatives, unit.stranger) for unit in plan.units(flight)}
        assert found == {(False, None)}


def test_images_are_matched_once_over_each_world_with_something_to_find() -> None:
    plan = plan_of("tiny", "flat")
    matched = replace(plan, protocol=Protocol(baselines=2))
    assert all(unit.appearance is None for f in plan.flights for unit in plan.units(f))
    chosen = [matched.units(flight)[0].appearance for flight in matched.flights]
    assert chosen == [matched.flights[0], None, None, None]
    assert matched.units(matched.flights[0])[1].appearance is None
    assert matched.units(next(matched.further_flights()))[0].appearance is None


def test_options_set_the_amount(tmp_path: Path) -> None:
    plan = Reproduce(out=tmp_path).plan()
    assert (plan.protocol.sequences, plan.sequences) == (6, 0)
    more = ("protocol.sequences_per_flight=14",)
    plan = Reproduce(out=tmp_path, sequences=500, overrides=more).plan()
    assert (plan.protocol.sequences, plan.sequences) == (14, 500)


def test_recordings_that_are_there_are_not_expected_to_be_drawn(tmp_path: Path) -> None:
    asked = Reproduce(out=tmp_path / "out", scenes=("tiny",), flights=2, alone=True)
    plan, kept = asked.plan(), tmp_path / "kept"
    both_s = asked._core_s(plan, kept)
    (kept / recording_name(plan.flights[0])).mkdir(parents=True)
    drawn_s = plan.flights[0].scene.duration_s * RENDER_S_PER_S
    assert asked._core_s(plan, kept) == pytest.approx(both_s - drawn_s)
    assert replace(asked, render=True)._core_s(plan, kept) == pytest.approx(both_s)


def test_each_flight_over_a_heap_of_its_own() -> None:
    scenes = [load_scene("tiny"), load_scene("flat")]
    flown = flights_over(scenes, 2, NOMINAL, 5, heaps=True)
    assert [(f.scene.name, f.seed, f.flight) for f in flown] == [
        ("tiny", 5, 0), ("tiny", 6, 0), ("flat", 5, 0), ("flat", 6, 0),
    ]  # fmt: skip
    further = Plan(flown, [Setup(Config())], Protocol(), sequences=99).further_flights()
    assert [(f.scene.name, f.seed) for f in islice(further, 3)] == [
        ("tiny", 7), ("tiny", 8), ("tiny", 9),
    ]  # fmt: skip


@pytest.mark.parametrize("preset", ["paper", "paper_literal"])
def test_the_papers_presets_repeat_the_papers_experiments(preset: str, tmp_path: Path) -> None:
    plan = Reproduce(out=tmp_path / "out", preset=preset).plan()  # type: ignore[arg-type]
    indoors = [f for f in plan.flights if f.scene.name not in UNSCORED_SCENES]
    assert len({(f.scene.name, f.seed) for f in plan.flights}) == len(plan.flights)
    assert {flight.sensors.name for flight in plan.flights} == {"paper"}
    assert {setup.poses for setup in plan.setups} == {"slam"}
    assert len(indoors) * plan.protocol.sequences >= published.SEQUENCES.value
    assert len(indoors) * plan.protocol.trials >= published.REFINEMENT_TRIALS.value
    names = [setup.config.preset for setup in plan.setups]
    assert names[0] == preset
    assert sorted(names) == ["best", "paper", "paper_literal"]


def test_named_sensors_and_scenes_win_over_those_of_the_paper(tmp_path: Path) -> None:
    asked = Reproduce(out=tmp_path / "out", preset="paper", scenes=("tiny",), sensors="none")
    (*flights,) = asked.plan().flights
    assert {(f.scene.name, f.sensors.name) for f in flights} == {("tiny", "none")}
    quick = Reproduce(out=tmp_path / "out", preset="paper", quick=True).plan()
    assert [(f.scene.name, f.sensors.name) for f in quick.flights] == [("tiny", "paper")]

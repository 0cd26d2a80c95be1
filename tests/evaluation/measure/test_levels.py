"""Levels: what they fix, what they refuse, and that none changes under its name and version."""

from __future__ import annotations

import json
from dataclasses import fields, is_dataclass
from pathlib import Path

import pytest
import tomli_w

from airground.errors import InputError
from airground.io.digests import bytes_digest
from evaluation.cli import parse
from evaluation.commands.reproduce import Reproduce
from evaluation.judge.runs import against
from evaluation.judge.summary import build_summary
from evaluation.measure.levels.level import load_level, parse_level
from evaluation.measure.plans.reproduce import Plan
from evaluation.measure.work.measure import recording_name
from evaluation.setup.level_mark import LEVELS, LevelMark
from sim.scene import load_scene
from tests.evaluation.judge.flights import make_results
from tests.evaluation.show.made_runs import INFO, made_run

DIGESTS = {
    "paper 1": "d965402b75c29696",
    "easy 1": "accc3444c4683e55",
    "medium 1": "d2f42717acc7119a",
    "hard 1": "086de16413d2d661",
    "extreme 1": "367fb218bf932290",
    "extreme 2": "1d8eb6413f6cde37",
}
"""Of all that a level flies. A level that should differ gets a new version: these lines only grow.
"""


OTHER_SCENE = tomli_w.dumps(
    load_level("easy").model_dump() | {"dials_of": {"tiny": {"scene.light": 1.0}}}
)


def plan(*words: str) -> Plan:
    made = parse("reproduce", [*words, "--out", "nowhere"])
    assert isinstance(made, Reproduce)
    return made.plan()


def stated(value: object) -> object:
    """A dataclass as JSON without its defaults, so that a new field that is off changes nothing."""
    if isinstance(value, tuple):
        return [stated(one) for one in value]
    if not is_dataclass(value):
        return value
    given = {field.name: (getattr(value, field.name), field.default) for field in fields(value)}
    return {name: stated(one) for name, (one, default) in given.items() if one != default}


@pytest.mark.parametrize("name", LEVELS)
def test_no_level_changes_under_its_name_and_version(name: str) -> None:
    level = load_level(name)
    flown = [
        (flight.scene.model_dump(mode="json", exclude_defaults=True), stated(flight.sensors))
        for flight in level.flown(1, seed=0)
    ]
    text = json.dumps([level.heading, level.heaps, flown], sort_keys=True)
    assert bytes_digest(text.encode())[:16] == DIGESTS[str(level.mark)]


def test_easy_is_the_protocol_and_paper_is_the_twin() -> None:
    for level, usual in (
        (("--level", "easy"), ()),
        (("--level", "easy", "--preset", "paper"), ("--preset", "paper", "--level", "easy")),
        (("--level", "paper", "--preset", "paper"), ("--preset", "paper")),
    ):
        here, there = plan(*level), plan(*usual)
        assert here == there
        for flight in here.flights:
            assert here.units(flight) == there.units(flight)


@pytest.mark.parametrize("name", ["medium", "hard", "extreme"])
def test_all_setups_of_a_level_search_the_heading_and_name_it(name: str) -> None:
    made = plan("--level", name)
    assert {setup.config.localization.heading for setup in made.setups} == {"search"}
    assert {setup.condition("harsh").variant for setup in made.setups} == {
        f"level {load_level(name).mark}"
    }
    assert {setup.config.preset for setup in made.setups} == {"best", "paper", "paper_literal"}
    conditions = [setup.condition("harsh") for setup in made.setups]
    assert len(set(conditions)) == len(conditions)


def test_dials_are_turned_where_they_have_a_meaning() -> None:
    flights = {flight.scene.name: flight for flight in plan("--level", "hard").flights}
    indoors, outdoors, flat = (flights[name] for name in ("indoor_a", "outdoor", "flat"))
    overlaps = {name: flight.scene.ground.stop_at_overlap for name, flight in flights.items()}
    assert overlaps == {
        "indoor_a": 0.46, "indoor_b": 0.58, "indoor_c": 0.46, "outdoor": 0.5, "flat": None,
    }  # fmt: skip
    assert indoors.scene.rubble is not None
    assert indoors.scene.rubble.changed == 0.15
    assert outdoors.dials == {"scene.overlap": 0.5, "scene.light": 0.5}
    assert flat.dials is None


def test_a_recording_with_dials_is_not_taken_for_one_without() -> None:
    names = [
        {recording_name(flight) for flight in load_level(name).flown(2, seed=0)}
        for name in ("hard", "extreme")
    ]
    assert {name for name in names[0] & names[1] if not name.startswith("flat_")} == set()
    assert any(name.endswith("_scene.light=0.5_scene.overlap=0.5") for name in names[0])


def test_further_flights_keep_the_dials() -> None:
    further = plan("--level", "hard", "--flights", "1").further_flights()
    assert [next(further).dials for _ in range(4)][3] == {"scene.overlap": 0.5, "scene.light": 0.5}


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--scenes", "tiny"), "--scenes: level hard fixes it"),
        (("--sensors", "none"), "--sensors: level hard fixes it"),
        (("--heading", "known"), "--heading: level hard fixes it"),
        (("--set", "localization.heading=known"), "--set localization.heading: level hard fixes"),
    ],
)
def test_what_a_level_fixes_is_not_given_as_well(words: tuple[str, ...], message: str) -> None:
    with pytest.raises(InputError, match=message):
        plan("--level", "hard", *words)


def test_a_smaller_set_and_a_level_exclude_each_other(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        plan("--level", "hard", "--quick")
    assert "--quick" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("name = 1", "odd.toml: no level: name"),
        ("name = ", "odd.toml: no TOML"),
        ("surprise = 1", "odd.toml: no level"),
        (OTHER_SCENE, "dials_of.tiny: is none of the scenes"),
    ],
)
def test_a_wrong_file_is_refused_in_one_line(text: str, message: str) -> None:
    with pytest.raises(InputError, match=message) as refusal:
        parse_level(text, "odd.toml")
    assert "\n" not in str(refusal.value)


def test_an_unknown_level_is_answered_with_the_known_ones() -> None:
    with pytest.raises(InputError, match="known are easy, extreme, hard, medium, paper"):
        load_level("harder")


def test_the_page_has_every_level_with_its_dials() -> None:
    page = (Path(__file__).parents[3] / "docs" / "levels.md").read_text(encoding="utf-8")
    rows = [line.strip("| ").split(" | ") for line in page.splitlines() if line.startswith("| ")]
    by_name = {cells[0].strip("`").partition("`")[0]: cells for cells in rows}
    columns = [cell.replace("`", "") for cell in rows[0][-len(LEVELS) :]]
    for name in LEVELS:
        level = load_level(name)
        column = columns.index(str(level.mark)) - len(LEVELS)
        for scene in level.scenes:
            for dial, value in level.point(load_scene(scene)).items():
                assert f"{value:g}" in by_name[dial][column]
        assert by_name["sensors"][column].startswith(f"`{level.sensors}`")


def test_summaries_state_the_level_and_compare_rejects_another() -> None:
    table = make_results(range(4))
    condition = table.conditions()[0]
    marks = [None, *(LevelMark(name="hard", version=version) for version in (1, 2))]
    summaries = [build_summary(table, condition, INFO, mark) for mark in marks]
    assert [summary.level for summary in summaries] == marks
    none, first, second = (
        made_run(str(mark), table, summary=summary)
        for mark, summary in zip(marks, summaries, strict=True)
    )
    against(none, first)
    against(first, first)
    with pytest.raises(InputError, match="hard 2: measured at level hard 2; expected level hard 1"):
        against(first, second)

"""The key of a unit depends on everything that determines its rows, and on nothing else."""

from __future__ import annotations

import copy
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from airground.config import Config, MonocularSlam
from airground.errors import InputError
from evaluation.measure.protocol.trials import Protocol
from evaluation.measure.work import unit as module
from evaluation.measure.work.unit import Unit, grouped, key_of
from evaluation.setup.setups import PoseNoise, Setup, with_localization
from sim.recording.recorder import Flight
from sim.scene import load_scene
from sim.sensors.presets import HARSH, NOMINAL
from sim.sensors.turned import with_heading_error, with_noise

TINY = load_scene("tiny")
FLIGHT = Flight(TINY, 3, 0, NOMINAL)
UNIT = Unit(FLIGHT, 3, 0, Setup(Config()), Protocol())

OTHERS: dict[str, list[Unit]] = {
    "recording": [
        replace(UNIT, recording=flight)
        for flight in (
            replace(FLIGHT, scene=TINY.model_copy(update={"texture": 0.5})),
            replace(FLIGHT, scene=load_scene("flat")),
            replace(FLIGHT, seed=4),
            replace(FLIGHT, flight=1),
            replace(FLIGHT, sensors=HARSH),
            replace(FLIGHT, sensors=with_noise(NOMINAL, 2.0)),
            replace(FLIGHT, sensors=with_heading_error(NOMINAL, 2.0)),
            replace(FLIGHT, duration_s=20.0),
        )
    ],
    "seed": [replace(UNIT, seed=4)],
    "flight": [replace(UNIT, flight=1)],
    "setup": [
        replace(UNIT, setup=setup)
        for setup in (
            Setup(with_localization(Config(), particles=400)),
            Setup(Config(monocular_slam=MonocularSlam(corners=99))),
            Setup(Config(), "oracle"),
            Setup(Config(), "slam", PoseNoise(white_m=0.01)),
            Setup(Config(), variant="other"),
        )
    ],
    "protocol": [replace(UNIT, protocol=Protocol(**{f.name: 99})) for f in fields(Protocol)],
    "showcase": [replace(UNIT, showcase=True)],
    "budget": [replace(UNIT, budget=True)],
    "baselines": [replace(UNIT, baselines=True)],
    "negatives": [replace(UNIT, negatives=True)],
    "stranger": [
        replace(UNIT, stranger=stranger)
        for stranger in (FLIGHT, replace(FLIGHT, seed=4), replace(FLIGHT, scene=load_scene("flat")))
    ],
    "appearance": [
        replace(UNIT, appearance=flight) for flight in (FLIGHT, replace(FLIGHT, seed=4))
    ],
}


def test_every_attribute_changes_the_key() -> None:
    assert OTHERS.keys() == {field.name for field in fields(Unit)}
    units = [UNIT, *(unit for others in OTHERS.values() for unit in others)]
    assert len({unit.key() for unit in units}) == len(units)


def test_equal_units_have_the_same_key() -> None:
    assert replace(UNIT, setup=Setup(Config()), protocol=Protocol()).key() == UNIT.key()
    assert UNIT.key() == key_of(dict(reversed(UNIT.made_from().items())))


def test_the_code_changes_the_key(monkeypatch: pytest.MonkeyPatch) -> None:
    before = UNIT.key()
    monkeypatch.setattr(module, "code_version", lambda: "other")
    assert UNIT.key() != before


def leaves(part: Any, path: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    """Where every number, word and nothing stands in nested dicts and lists."""
    if isinstance(part, dict) and part:
        return [leaf for key in part for leaf in leaves(part[key], (*path, key))]
    if isinstance(part, list) and part:
        return [leaf for i in range(len(part)) for leaf in leaves(part[i], (*path, i))]
    return [path]


LEAVES = leaves(UNIT.made_from())


@settings(deadline=None)
@given(
    st.sampled_from(LEAVES),
    st.one_of(st.none(), st.booleans(), st.integers(), st.floats(allow_nan=False), st.text()),
)
def test_any_change_of_any_entry_changes_the_key(path: tuple[Any, ...], value: Any) -> None:
    if isinstance(value, float) and value in (float("inf"), float("-inf")):
        return  # no entry can be that
    made_from = copy.deepcopy(UNIT.made_from())
    part = made_from
    for step in path[:-1]:
        part = part[step]
    unchanged = repr(part[path[-1]]) == repr(value)
    part[path[-1]] = value
    assert (key_of(made_from) == UNIT.key()) == unchanged


def test_a_recording_is_identified_by_its_header(tmp_path: Path) -> None:
    stored = replace(UNIT, recording=tmp_path)
    with pytest.raises(InputError, match=r"recording\.toml: cannot be read"):
        stored.key()
    (tmp_path / "recording.toml").write_text("a = 1")
    before = stored.key()
    moved = tmp_path / "elsewhere"
    moved.mkdir()
    (moved / "recording.toml").write_text("a = 1")
    assert replace(UNIT, recording=moved).key() == before
    (moved / "recording.toml").write_text("a = 2")
    assert replace(UNIT, recording=moved).key() != before


def test_units_that_share_their_maps_form_a_group() -> None:
    few, many = (
        replace(UNIT, setup=Setup(with_localization(Config(), particles=n))) for n in (50, 800)
    )
    exact = replace(UNIT, setup=Setup(Config(), "oracle"))
    other_seed = replace(few, seed=9)
    assert grouped([few, exact, many, other_seed]) == [[few, many], [exact], [other_seed]]


def test_a_unit_with_extras_is_the_first_of_its_group() -> None:
    asked = {"showcase": True, "baselines": True, "negatives": True, "stranger": FLIGHT}
    shown, plain = replace(UNIT, **asked), replace(UNIT, seed=3)  # type: ignore[arg-type]
    assert grouped([shown, plain]) == [[shown, plain]]
    assert grouped([plain, shown]) == [[plain], [shown]]

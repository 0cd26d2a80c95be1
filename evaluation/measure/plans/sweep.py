"""Sweeps: from the words of `--vary` to points, flights and units."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product

from airground.errors import InputError
from airground.io.input_files import parse_toml
from evaluation.measure.plans.dials import Point, Subject, Value, turned
from evaluation.measure.protocol.trials import Protocol
from evaluation.measure.work.unit import Unit, grouped
from evaluation.setup.settings import parsed_value
from evaluation.setup.setups import Setup
from sim.recording.recorder import Flight
from sim.scene import Scene
from sim.sensors.presets import SensorPreset


@dataclass(frozen=True)
class SweepPlan:
    """What to sweep.

    Attributes:
        varied: Dials and their values.
        scenes: Scenes to fly over.
        flights: Number of flights over each scene, each over a heap of its own.
        setup, sensors: Setup and sensors before the dials are turned.
        protocol: Extent of the measurements on each flight.
        seed: Seed of the first flight; the next ones have the next seeds.
        duration_s: Duration at which flights are cut [s]; None for that of the scene.
    """

    varied: tuple[Vary, ...]
    scenes: tuple[Scene, ...]
    flights: int
    setup: Setup
    sensors: SensorPreset
    protocol: Protocol
    seed: int
    duration_s: float | None = None

    def points(self) -> list[Point]:
        """Every combination of the dials' values."""
        return points(self.varied)

    def units(self, point: Point) -> list[Unit]:
        """Units of one point, with the same seeds at each, so that points are paired; raises
        InputError if a dial cannot have its value."""
        return [unit for scene in self.scenes for unit in self._of_scene(scene, point)]

    def tasks(self) -> int:
        """How many tasks there are at most: units that share their maps are done together."""
        return len(grouped(unit for point in self.points() for unit in self.units(point)))

    def _of_scene(self, scene: Scene, point: Point) -> Sequence[Unit]:
        subject = turned(Subject(scene, self.sensors, self.setup.config), point)
        setup = replace(self.setup, config=subject.config)
        return [
            Unit(
                Flight(subject.scene, seed, 0, subject.sensors, self.duration_s),
                seed,
                0,
                setup,
                self.protocol,
            )
            for seed in range(self.seed, self.seed + self.flights)
        ]


MAX_POINTS = 1000


@dataclass(frozen=True)
class Vary:
    """A dial and the values that it takes, in the order given."""

    name: str
    values: tuple[Value, ...]


def parse_vary(words: Sequence[str]) -> tuple[Vary, ...]:
    """What `NAME=VALUE,VALUE,...` says, each value as in TOML.

    Raises:
        InputError: There is none, one is not of this form, a dial comes twice, a value twice, or
            there are more points than anyone would wait for.
    """
    varied = tuple(_parsed(word) for word in words)
    if not varied:
        raise InputError("--vary: name a dial and its values, as in localization.particles=50,200")
    names = [vary.name for vary in varied]
    for name in names:
        if names.count(name) > 1:
            raise InputError(f"--vary {name}: given twice; list all its values at once")
    count = len(points(varied))
    if count > MAX_POINTS:
        raise InputError(f"--vary: {count} combinations are more than {MAX_POINTS}")
    return varied


def points(varied: Sequence[Vary]) -> list[Point]:
    """Every combination of the values, the first dial's changing slowest."""
    names = [vary.name for vary in varied]
    combinations = product(*(vary.values for vary in varied))
    return [dict(zip(names, values, strict=True)) for values in combinations]


def _parsed(word: str) -> Vary:
    name, equals, text = word.partition("=")
    name = name.strip()
    section, dot, key = name.partition(".")
    if not (equals and dot and section and key and text.strip()):
        raise InputError(f"--vary {word}: expected NAME=VALUE,VALUE,... with a dot in NAME")
    values = _values(text)
    for value in values:
        if values.count(value) > 1:
            raise InputError(f"--vary {word}: {value!r} is listed twice")
    return Vary(name, tuple(values))


def _values(text: str) -> list[Value]:
    """A value may hold commas of its own, as a list does."""
    try:
        values: list[Value] = parse_toml(f"values = [{text}]")["values"]
    except ValueError:
        values = [parsed_value(part) for part in text.split(",")]
    return values

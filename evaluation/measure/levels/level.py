"""A level of difficulty: what the simulator does, apart from the method that is measured.

A level fixes scenes, sensors, dials, whether flights share a heap, and where the heading comes
from. It is cited by name and version; `docs/levels.md` says what freezing means.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from importlib import resources
from typing import Annotated, Literal, Self

from pydantic import Field, ValidationError, model_validator

from airground.config import Config
from airground.errors import InputError
from airground.io.input_files import parse_toml
from evaluation.measure.plans.dials import Subject, turned
from evaluation.measure.plans.reproduce import flights_over
from evaluation.setup.checked_json import Count, Part
from evaluation.setup.level_mark import LevelMark
from evaluation.setup.setups import Setup, with_localization
from evaluation.table.rows import CONTROL_SCENES
from sim.recording.recorder import Flight
from sim.scene import Scene, load_scene
from sim.sensors.presets import sensor_preset

AtLeastOne = Annotated[int, Field(ge=1)]


class Level(Part):
    """The contents of a level's file.

    Attributes:
        name, version: How it is cited. Another version is another level.
        description: One line.
        sensors: Sensor preset.
        scenes: Scenes to fly over.
        heading: "known" from the magnetometers, or "search".
        heaps: Whether every flight is over a heap of its own.
        dials: Dials and their values, in all scenes with something to find.
        dials_of: Dials of single scenes beside these, by the scene's name.
        flights: Flights over each scene, where no option says otherwise.
        sequences, trials, baselines: Numbers on each flight, as of `Protocol`.
        negatives: Whether negative cases are tried.
        only_images: Whether only the baselines that match images are tried.
    """

    name: str
    version: AtLeastOne
    description: str
    sensors: str
    scenes: Annotated[tuple[str, ...], Field(min_length=1)]
    heading: Literal["known", "search"]
    heaps: bool
    dials: dict[str, float] = Field(default_factory=dict)
    dials_of: dict[str, dict[str, float]] = Field(default_factory=dict)
    flights: AtLeastOne
    sequences: AtLeastOne
    trials: AtLeastOne
    baselines: Count
    negatives: bool = True
    only_images: bool = False

    @property
    def mark(self) -> LevelMark:
        return LevelMark(name=self.name, version=self.version)

    @property
    def variant(self) -> str:
        """How the rows of results name it; empty where name and sensors of the scenes say it all,
        so that results without a level can be held against it."""
        return f"level {self.mark}" if self.dials or self.dials_of else ""

    def flown(self, flights: int, seed: int) -> list[Flight]:
        """So many flights over each scene, with the dials turned.

        Raises:
            InputError: A scene or a dial is unknown, or a value is out of its range.
        """
        made: list[Flight] = []
        for name in self.scenes:
            scene, sensors = load_scene(name), sensor_preset(self.sensors)
            point = self.point(scene)
            subject = turned(Subject(scene, sensors, Config()), point)
            of_scene = flights_over([subject.scene], flights, subject.sensors, seed, self.heaps)
            made += [replace(flight, dials=point or None) for flight in of_scene]
        return made

    def under(self, setups: Sequence[Setup]) -> list[Setup]:
        """The setups as rows of this level name them, each once; where the heading is searched,
        all search for it."""
        kept: list[Setup] = []
        for setup in setups:
            config = setup.config
            if self.heading == "search":
                config = with_localization(config, heading="search")
            here = replace(setup, config=config, variant=self.variant)
            kept += [here] if here not in kept else []
        return kept

    def point(self, scene: Scene) -> dict[str, float]:
        """What is turned in a scene; nothing where there is nothing to find."""
        if scene.name in CONTROL_SCENES:
            return {}
        return self.dials | self.dials_of.get(scene.name, {})

    @model_validator(mode="after")
    def _dials_are_of_its_scenes(self) -> Self:
        others = set(self.dials_of) - set(self.scenes)
        if others:
            raise ValueError(f"dials_of.{min(others)}: is none of the scenes")
        return self


def load_level(name: str) -> Level:
    """The level of this name.

    Raises:
        InputError: There is none.
    """
    folder = resources.files("evaluation.measure.levels")
    known = sorted(file.name[:-5] for file in folder.iterdir() if file.name.endswith(".toml"))
    if name not in known:
        raise InputError(f"unknown level '{name}': known are {', '.join(known)}")
    file = f"{name}.toml"
    return parse_level(folder.joinpath(file).read_text(encoding="utf-8"), file)


def parse_level(text: str, file: str) -> Level:
    """Check the text of a level's file; `file` is what messages call it.

    Raises:
        InputError: One line that names the file, the key and what would be right.
    """
    try:
        return Level.model_validate(parse_toml(text))
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(map(str, first["loc"])) or "the file"
        raise InputError(f"{file}: no level: {where}: {first['msg']}") from None
    except ValueError as error:
        raise InputError(f"{file}: no TOML: {error}") from None

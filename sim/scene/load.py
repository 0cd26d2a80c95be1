"""Scene files by name or path, and one line for what is wrong in one."""

from __future__ import annotations

from importlib import resources
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from airground.errors import InputError
from airground.io.input_files import SETTINGS_LIMIT, parse_toml, read_text
from sim.scene.bodies import Body
from sim.scene.light import Light
from sim.scene.part import Part
from sim.scene.paths import GroundPath, MavPath
from sim.scene.room import Room
from sim.scene.rubble import Rubble
from sim.scene.scene import Scene
from sim.scene.terrain import Terrain
from sim.scene.things import Debris, Shelves, Street


def scene_names() -> list[str]:
    """Names of the scenes that come with the package, sorted."""
    files = resources.files("scenes").iterdir()
    return sorted(file.name[:-5] for file in files if file.name.endswith(".toml"))


def load_scene(name: str) -> Scene:
    """Read a scene by name, or from the path of a `.toml` file.

    Raises:
        InputError: There is no such scene, or the file breaks a rule: names file and key.
    """
    if name.endswith(".toml"):
        path = Path(name)
        try:
            return parse_scene(read_text(path, SETTINGS_LIMIT), str(path))
        except (OSError, UnicodeDecodeError) as error:
            reason = error.strerror if isinstance(error, OSError) else error
            raise InputError(f"{path}: cannot read this scene file ({reason})") from None
    if name not in scene_names():
        known = ", ".join(scene_names())
        raise InputError(f"unknown scene '{name}': known are {known}, or the path of a .toml file")
    text = resources.files("scenes").joinpath(f"{name}.toml").read_text(encoding="utf-8")
    return parse_scene(text, f"scenes/{name}.toml")


def parse_scene(text: str, file: str) -> Scene:
    """Check the text of a scene file; `file` is what messages call it.

    Raises:
        InputError: One line that names the file, the key and what would be right.
    """
    try:
        return Scene.model_validate(parse_toml(text))
    except ValidationError as error:
        raise InputError(f"{file}: {_first_problem(error)}") from None
    except ValueError as error:
        raise InputError(f"{file}: not valid TOML: {error}") from None


def _first_problem(error: ValidationError) -> str:
    """One line for the first complaint: key, value, and what would be right."""
    problem = error.errors(include_url=False)[0]
    location = problem["loc"]
    key = ".".join(str(step) for step in location)
    if problem["type"] == "extra_forbidden":
        known = ", ".join(_known_keys(location[:-1]))
        return f"unknown key '{key}'; known here are {known}"
    if problem["type"] == "missing":
        return f"key '{key}' is missing"
    message = problem["msg"].removeprefix("Value error, ")
    if not key:
        return message
    if problem["type"] == "value_error":
        return f"{key}: {message}"
    return f"{key} = {problem['input']!r}: {message[0].lower()}{message[1:]}"


def _known_keys(location: tuple[Any, ...]) -> list[str]:
    tables: dict[str, type[Part]] = {
        "room": Room,
        "light": Light,
        "flight_light": Light,
        "rubble": Rubble,
        "terrain": Terrain,
        "bodies": Body,
        "shelves": Shelves,
        "street": Street,
        "debris": Debris,
        "mav": MavPath,
        "ground": GroundPath,
    }
    model = tables[str(location[0])] if location else Scene
    return list(model.model_fields)

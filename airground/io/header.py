"""`recording.toml`: what was recorded, and the nominal calibration of the sensors."""

from __future__ import annotations

import re
import reprlib
from pathlib import Path
from typing import Annotated, Any, Literal, TypeVar

import tomli_w
from pydantic import Field, ValidationError, model_validator

from airground.errors import RecordingError
from airground.io.calibration import CalibrationTable, Table
from airground.io.input_files import read_toml_text

SCHEMA = 1
NAMES = {"mav": "MAV", "ground": "ground robot"}
"""The robots in words."""
_NUMBERS = re.compile(r"\[\s+([-+.\deE,\s]+?)\s+\]")  # an array of numbers over many lines
_SHORT = reprlib.Repr()
_SHORT.maxlevel, _SHORT.maxlist, _SHORT.maxstring, _SHORT.maxother = 2, 16, 60, 60


class FrameCounts(Table):
    """How many images each camera took; 0 of a robot that was not recorded."""

    mav: Annotated[int, Field(ge=0)]
    ground: Annotated[int, Field(ge=0)]

    @model_validator(mode="after")
    def _any(self) -> FrameCounts:
        if not self.robots():
            raise ValueError("one robot at least must have images")
        return self

    def robots(self) -> tuple[Literal["mav", "ground"], ...]:
        """The robots that were recorded."""
        counts: dict[Literal["mav", "ground"], int] = {"mav": self.mav, "ground": self.ground}
        return tuple(robot for robot, count in counts.items() if count)


class Header(Table):
    """The contents of `recording.toml`.

    Attributes:
        schema_version: Version of the recording's layout (key `schema`).
        scene, seed, flight: Name of the scene, seed of the heap, and number of the flight.
        sensors: Name of the sensor preset.
        dials: What was turned away from the scene's file and the preset, by name; None for nothing.
        duration_s: Length of the recording [s].
        frames: Numbers of images.
        calibration: Nominal calibration of the sensors, of both robots even if one was recorded.
        digests: SHA-256 of every text file and image folder by relative path.
    """

    schema_version: Annotated[int, Field(alias="schema")] = SCHEMA
    scene: str
    seed: int
    flight: int
    sensors: str
    dials: dict[str, float] | None = None
    duration_s: Annotated[float, Field(gt=0)]
    frames: FrameCounts
    calibration: CalibrationTable
    digests: dict[str, Annotated[str, Field(pattern="^[0-9a-f]{64}$")]]

    def facts(self) -> str:
        """What was recorded, in a line."""
        robots = self.frames.robots()
        alone = f", {NAMES[robots[0]]} alone" if len(robots) == 1 else ""
        return (
            f"{self.scene}, seed {self.seed}, flight {self.flight}, "
            f"{self.sensors} sensors, {self.duration_s:g} s{alone}"
        )


def read_header(path: Path) -> Header:
    """Read `recording.toml`; RecordingError if it is missing, of another schema or wrong."""
    tables = read_toml(path)
    schema = tables.get("schema")
    if schema != SCHEMA:
        raise RecordingError(f"{path}: schema is {schema!r}, this version reads {SCHEMA}")
    return parse_table(Header, tables, path)


def read_toml(path: Path) -> dict[str, Any]:
    """Raises RecordingError where the file is missing or no TOML."""
    try:
        return read_toml_text(path)
    except FileNotFoundError:
        raise RecordingError(f"{path}: no such file; is this a recording?") from None
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) else error
        raise RecordingError(f"{path}: cannot be read as TOML: {reason}") from None


def write_toml(path: Path, table: Table) -> None:
    """Write a table; the same values give the same bytes."""
    text = tomli_w.dumps(table.model_dump(by_alias=True, mode="json", exclude_none=True))
    compact = _NUMBERS.sub(lambda match: f"[{' '.join(match[1].split()).rstrip(',')}]", text)
    path.write_text(compact, encoding="utf-8")


AnyTable = TypeVar("AnyTable", bound=Table)


def parse_table(kind: type[AnyTable], values: dict[str, Any], path: Path) -> AnyTable:
    """`values` as a table; RecordingError names file, key, value and rule."""
    try:
        return kind.model_validate(values)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        key = ".".join(str(step) for step in first["loc"])
        if first["type"] == "extra_forbidden":
            raise RecordingError(f"{path}: unknown key '{key}'") from None
        if first["type"] == "missing":
            raise RecordingError(f"{path}: key '{key}' is missing") from None
        message = first["msg"].removeprefix("Value error, ")
        raise RecordingError(
            f"{path}: key '{key}': {message}, got {shortened(first['input'])}"
        ) from None


def shortened(value: object) -> str:
    """A value from a file, short enough for one line."""
    return _SHORT.repr(value)

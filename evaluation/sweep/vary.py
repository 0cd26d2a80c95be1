"""From the words of `--vary` to the points of a sweep."""

from __future__ import annotations

import tomllib
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

from airground.errors import InputError
from evaluation.settings import parsed_value
from evaluation.sweep.dials import Point, Value

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
        values: list[Value] = tomllib.loads(f"values = [{text}]")["values"]
    except tomllib.TOMLDecodeError:
        values = [parsed_value(part) for part in text.split(",")]
    return values

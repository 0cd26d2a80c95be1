"""How results cite a level of difficulty."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from airground.errors import InputError
from evaluation.setup.checked_json import Part

LEVELS = ("paper", "easy", "medium", "hard", "extreme")
"""The levels that come with airground, in the order of tables."""


class LevelMark(Part):
    """Name and version of a level; another version is another level."""

    name: str
    version: Annotated[int, Field(ge=1)]

    def __str__(self) -> str:
        return f"{self.name} {self.version}"

    @property
    def sort_key(self) -> tuple[int, str, int]:
        """What tables sort levels by: in order, and others after them."""
        known = LEVELS.index(self.name) if self.name in LEVELS else len(LEVELS)
        return known, self.name, self.version


def check_same_level(first: LevelMark | None, second: LevelMark | None, name: str) -> None:
    """Before results are held against each other.

    Args:
        first, second: Levels of both; None where one states none.
        name: What messages call the second.

    Raises:
        InputError: Both state a level, and they differ.
    """
    if first is not None and second is not None and first != second:
        raise InputError(f"{name}: measured at level {second}; expected level {first}")

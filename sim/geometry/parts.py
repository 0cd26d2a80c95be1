"""Which triangles of a world's surface belong to which thing: the source of segmentation."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from airground.errors import RecordingError
from airground.io.input_files import TEXT_LIMIT, read_text

Kind = Literal[
    "ground", "wall", "box", "rock", "stone", "plant",
    "post", "board", "column", "slab", "beam", "brick", "body", "pavement", "front",
]  # fmt: skip
KINDS: tuple[Kind, ...] = get_args(Kind)
"""Class ids are places in this tuple, counted from 1; 0 is nothing. New kinds go to the end."""
_COLUMNS = ["name", "class", "triangles"]


@dataclass(frozen=True)
class Part:
    """Consecutive triangles of the surface's mesh.

    Attributes:
        name: Name of the thing; parts of one name are one thing.
        kind: Class of the thing.
        triangles: Number of triangles, at least 1.
    """

    name: str
    kind: Kind
    triangles: int


def write_parts(path: Path, parts: Sequence[Part]) -> None:
    """Write parts in the mesh's order as CSV."""
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(_COLUMNS)
        writer.writerows([part.name, part.kind, part.triangles] for part in parts)


def read_parts(path: Path) -> list[Part]:
    """Read what `write_parts` wrote; RecordingError if it is missing or wrong."""
    try:
        rows = list(csv.reader(read_text(path, TEXT_LIMIT).splitlines()))
    except FileNotFoundError:
        raise RecordingError(
            f"{path}: no such file; older versions of simulate did not write it"
        ) from None
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise RecordingError(f"{path}: cannot be read as CSV: {error}") from None
    if not rows or rows[0] != _COLUMNS:
        raise RecordingError(f"{path}:1: must be the columns {','.join(_COLUMNS)}")
    return [_part(row, f"{path}:{line}") for line, row in enumerate(rows[1:], start=2)]


def _part(row: list[str], where: str) -> Part:
    name, kind, count = row if len(row) == len(_COLUMNS) else ("", "", "")
    known: dict[str, Kind] = {one: one for one in KINDS}
    triangles = int(count) if count.isdecimal() and len(count) < 10 else 0
    if not name or kind not in known or triangles == 0:
        raise RecordingError(
            f"{where}: must be a name, one of {', '.join(KINDS)}, and a number above 0"
        )
    return Part(name, known[kind], triangles)


@dataclass(frozen=True, eq=False)
class Instances:
    """The things of a surface; ids count from 1 in the order of `parts`, 0 is nothing.

    Attributes:
        names, kinds: Name and class of each thing, that with id 1 first.
        of_triangle: (T,) uint16 id of the thing that each triangle of the mesh belongs to.
    """

    names: list[str]
    kinds: list[Kind]
    of_triangle: NDArray[np.uint16]

    @classmethod
    def of(cls, parts: Sequence[Part], others: Sequence[Part] = ()) -> Instances:
        """The things of a mesh.

        Args:
            parts: Parts of the mesh.
            others: Parts of another mesh, whose things have the first ids: so that things of one
                name have the same id in both.

        Raises:
            ValueError: There are more than 65535 things.
        """
        kinds = {part.name: part.kind for part in (*others, *parts)}
        if len(kinds) > np.iinfo(np.uint16).max:
            raise ValueError(f"{len(kinds)} things do not fit 16-bit ids")
        ids = {name: index for index, name in enumerate(kinds, start=1)}
        of_part = np.array([ids[part.name] for part in parts], np.uint16)
        of_triangle = np.repeat(of_part, [part.triangles for part in parts])
        return cls(list(kinds), list(kinds.values()), of_triangle)

    def class_ids(self) -> NDArray[np.uint8]:
        """(I + 1,) class id of each instance id."""
        return np.array([0, *(KINDS.index(kind) + 1 for kind in self.kinds)], np.uint8)

"""Point clouds as binary PLY files, with normals and the robot that saw each point."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from airground.core.arrays import U8
from airground.core.cloud import PointCloud
from airground.errors import InputError
from airground.io.ply_elements import Table, read_elements

_POSITION = [("x", "<f4"), ("y", "<f4"), ("z", "<f4")]
_NORMAL = [("nx", "<f4"), ("ny", "<f4"), ("nz", "<f4")]
_COLOUR = [("red", "u1"), ("green", "u1"), ("blue", "u1")]
_SOURCE = [("source", "u1")]
_PLY_TYPES = {"<f4": "float", "u1": "uchar"}


def write_ply(path: Path | str, cloud: PointCloud, sources: U8 | None = None) -> None:
    """Write a cloud; `sources` (N,) becomes the property `source` that viewers ignore."""
    fields = _POSITION + (_NORMAL if cloud.normals is not None else []) + _COLOUR
    fields = fields + (_SOURCE if sources is not None else [])
    table = np.zeros(len(cloud), np.dtype(fields))
    columns: list[tuple[list[tuple[str, str]], NDArray[Any]]]
    columns = [(_POSITION, cloud.points), (_COLOUR, cloud.colours)]
    if cloud.normals is not None:
        columns.append((_NORMAL, cloud.normals))
    if sources is not None:
        if sources.shape != (len(cloud),):
            raise ValueError(f"sources: expected shape ({len(cloud)},), got {sources.shape}")
        columns.append((_SOURCE, sources[:, None]))
    for names, values in columns:
        for index, (name, _) in enumerate(names):
            table[name] = values[:, index]
    properties = [f"property {_PLY_TYPES[kind]} {name}" for name, kind in fields]
    header = ["ply", "format binary_little_endian 1.0", f"element vertex {len(cloud)}"]
    text = "\n".join([*header, *properties, "end_header"]) + "\n"
    Path(path).write_bytes(text.encode("ascii") + table.tobytes())


def read_ply(path: Path) -> tuple[PointCloud, U8 | None]:
    """Read what `write_ply` wrote: the cloud, and the sources if they are in the file.
    InputError if the file is missing, truncated, or holds another kind of PLY."""
    table = read_elements(path, ("vertex",)).get("vertex")
    if table is None:
        raise InputError(f"{path}: PLY lacks element vertex")
    names = table.dtype.names or ()
    normals = _columns(path, table, _NORMAL) if "nx" in names else None
    sources = _columns(path, table, _SOURCE)[:, 0] if "source" in names else None
    position, colour = (_columns(path, table, fields) for fields in (_POSITION, _COLOUR))
    try:
        return PointCloud(position, colour, normals), sources
    except ValueError as error:
        raise InputError(f"{path}: {error}") from None


def _columns(path: Path, table: Table, fields: list[tuple[str, str]]) -> NDArray[Any]:
    kinds = {name: table.dtype[name] for name in table.dtype.names or ()}
    for name, kind in fields:
        if name not in kinds:
            raise InputError(f"{path}: PLY lacks {name}")
        if np.dtype(kinds[name]) != np.dtype(kind):
            expected = _PLY_TYPES[kind]
            raise InputError(
                f"{path}: PLY has '{name}' of another type, expected binary {expected}"
            )
    return np.stack([table[name] for name, _ in fields], axis=1)

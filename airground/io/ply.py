"""Point clouds as binary PLY files, with normals and the robot that saw each point."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from airground.core.arrays import U8
from airground.core.cloud import PointCloud
from airground.errors import InputError
from airground.io.input_files import MODEL_LIMIT, read_bytes

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
    try:
        data = read_bytes(path, MODEL_LIMIT)
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from None
    header, marker, body = data.partition(b"end_header\n")
    if not data.startswith(b"ply\n") or not marker:
        raise InputError(f"{path}: is no PLY file")
    count, dtype = _parse_header(path, header.decode("ascii", "replace"))
    if len(body) != count * dtype.itemsize:
        raise InputError(
            f"{path}: holds {len(body)} bytes of points, {count} points need "
            f"{count * dtype.itemsize}"
        )
    table = np.frombuffer(body, dtype)
    names = dtype.names or ()
    normals = _columns(table, _NORMAL) if "nx" in names else None
    sources = table["source"].copy() if "source" in names else None
    try:
        cloud = PointCloud(_columns(table, _POSITION), _columns(table, _COLOUR), normals)
    except ValueError as error:
        raise InputError(f"{path}: {error}") from None
    return cloud, sources


def _parse_header(path: Path, header: str) -> tuple[int, np.dtype[np.void]]:
    """Number of points and the type of one."""
    kinds = {ply: kind for kind, ply in _PLY_TYPES.items()}
    count: int | None = None
    fields: list[tuple[str, str]] = []
    for line in header.splitlines()[1:]:
        match line.split():
            case ["format", "binary_little_endian", "1.0"] | ["comment", *_]:
                pass
            case ["element", "vertex", number] if number.isdecimal() and len(number) < 19:
                count = int(number)
            case ["property", kind, name] if kind in kinds and name not in dict(fields):
                fields.append((name, kinds[kind]))
            case _:
                raise InputError(f"{path}: cannot read the PLY header line '{line[:60]}'")
    names = {name for name, _ in fields}
    missing = [name for name, _ in _POSITION + _COLOUR if name not in names]
    if count is None or missing:
        raise InputError(f"{path}: PLY lacks {', '.join(missing) or 'element vertex'}")
    return count, np.dtype(fields)


def _columns(table: NDArray[Any], fields: list[tuple[str, str]]) -> NDArray[Any]:
    return np.stack([table[name] for name, _ in fields], axis=1)

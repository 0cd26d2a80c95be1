"""Elements of any PLY file as numpy tables.

Open3D's reader ends the process at some damaged files; trimesh refuses meshes of mixed polygons.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from airground.errors import InputError
from airground.io.input_files import MODEL_LIMIT, read_bytes

Table = NDArray[Any]
"""(N,) structured array: a field for each property of an element, by its name in the header."""

_TYPES = {"char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2"}
_TYPES |= {"int": "i4", "uint": "u4", "float": "f4", "double": "f8"}
_TYPES |= {"int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2"}
_TYPES |= {"int32": "i4", "uint32": "u4", "float32": "f4", "float64": "f8"}
_ORDERS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
_MOST_LINES = 1000
"""Lines of the longest header."""


@dataclass(frozen=True)
class _Element:
    """What a header says of an element: number of rows, name and type of each property.

    A list's type is the pair of its length's and its items' types.
    """

    count: int
    properties: dict[str, str | tuple[str, str]]


def read_elements(path: Path, wanted: tuple[str, ...]) -> dict[str, Table]:
    """Tables of some elements of a PLY file, in text or binary.

    Args:
        path: File, or a link to one.
        wanted: Names of elements; those that the header does not have are left out. All lists of
            an element must have one length, and become fields of shape (N, length). This holds
            up to the last wanted element; what follows it is not read.

    Raises:
        InputError: One line: the file is missing, truncated, or holds something else.
    """
    try:
        data = read_bytes(path, MODEL_LIMIT)
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from None
    head, marker, body = data.partition(b"end_header")
    end_of_line = body.find(b"\n")
    if not data.startswith(b"ply") or not marker or end_of_line < 0:
        raise InputError(f"{path}: is no PLY file")
    order, elements = _parse_header(path, head.decode("ascii", "replace"))
    last = max((k for k, name in enumerate(elements) if name in wanted), default=-1)
    rows = body[end_of_line + 1 :]
    source = _Binary(path, rows, order) if order else _Text(path, rows)
    tables = {}
    for name, element in list(elements.items())[: last + 1]:
        table = source.take(name, element)
        if name in wanted:
            tables[name] = table
    if last == len(elements) - 1 and source.left() > 0:
        raise InputError(f"{path}: has more after the last row that its header names")
    return tables


def columns(path: Path, table: Table, names: tuple[str, ...]) -> NDArray[np.float64]:
    """(N, len(names)) numbers of a table; InputError if it lacks one of them."""
    missing = [name for name in names if name not in (table.dtype.names or ())]
    if missing:
        raise InputError(f"{path}: PLY lacks {', '.join(missing)}")
    return np.stack([table[name].astype(np.float64) for name in names], axis=1)


def _parse_header(path: Path, head: str) -> tuple[str, dict[str, _Element]]:
    """Byte order ("" for text) and the elements in their order."""
    lines = [line.strip() for line in head.splitlines()[1:]]
    if len(lines) > _MOST_LINES:
        raise InputError(f"{path}: its PLY header has more than {_MOST_LINES} lines")
    order: str | None = None
    elements: dict[str, _Element] = {}
    for line in lines:
        current = next(reversed(elements.values()), None)
        match line.split():
            case [] | ["comment" | "obj_info", *_]:
                continue
            case ["format", kind, "1.0"] if kind in _ORDERS and order is None:
                order = _ORDERS[kind]
                continue
            case ["element", name, count] if count.isdecimal() and len(count) < 19:
                if name not in elements:
                    elements[name] = _Element(int(count), {})
                    continue
            case ["property", kind, name] if current is not None and kind in _TYPES:
                if name not in current.properties:
                    current.properties[name] = _TYPES[kind]
                    continue
            case ["property", "list", length, kind, name] if current is not None:
                known = _TYPES.get(length, "f")[0] in "iu" and kind in _TYPES
                if known and name not in current.properties:
                    current.properties[name] = (_TYPES[length], _TYPES[kind])
                    continue
        raise InputError(f"{path}: cannot read the PLY header line '{line[:60]}'")
    if order is None:
        raise InputError(f"{path}: its PLY header lacks a format")
    return order, elements


@dataclass
class _Binary:
    """The bytes after the header, taken from their start."""

    path: Path
    body: bytes
    order: str
    start: int = 0

    def left(self) -> int:
        """Number of bytes that no row has taken."""
        return len(self.body) - self.start

    def take(self, name: str, element: _Element) -> Table:
        kind = self._row_type(element)
        if element.count == 0 or kind.itemsize == 0:
            return np.zeros(0, kind)
        need, there = element.count * kind.itemsize, self.left()
        if need > there:
            raise _truncated(self.path, name, element.count, f"{need} bytes", f"{there}")
        table = np.frombuffer(self.body, kind, element.count, self.start)
        self.start += need
        for other in kind.names or ():
            if other.startswith(_LENGTH) and np.ptp(table[other]) != 0:
                listed = other.removeprefix(_LENGTH)
                raise InputError(f"{self.path}: lists '{listed}' of '{name}' differ in length")
        return table

    def _row_type(self, element: _Element) -> np.dtype[Any]:
        """Type of a row; the first row's lists say how long all are."""
        fields: list[tuple[Any, ...]] = []
        at = self.start
        for name, kind in element.properties.items():
            if isinstance(kind, str):
                fields.append((name, self.order + kind))
            else:
                length_type = np.dtype(self.order + kind[0])
                first = self.body[at : at + length_type.itemsize]
                whole = element.count > 0 and len(first) == length_type.itemsize
                length = int(np.frombuffer(first, length_type)[0]) if whole else 0
                if not 0 <= length <= len(self.body):
                    raise InputError(f"{self.path}: a list '{name}' has a length of {length}")
                fields.append((_LENGTH + name, length_type))
                fields.append((name, self.order + kind[1], (length,)))
            at = self.start + np.dtype(fields).itemsize
        return np.dtype(fields)


class _Text:
    """The lines after the header, taken from their start."""

    def __init__(self, path: Path, body: bytes) -> None:
        self.path = path
        self.lines = body.splitlines()

    def left(self) -> int:
        """Number of lines with text that no row has taken."""
        return sum(bool(line.strip()) for line in self.lines)

    def take(self, name: str, element: _Element) -> Table:
        rows, self.lines = self.lines[: element.count], self.lines[element.count :]
        if len(rows) < element.count:
            raise _truncated(self.path, name, element.count, "a line each", f"{len(rows)} lines")
        if not rows:
            return np.zeros(0, [(one, "f8") for one in element.properties])
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("error")
                numbers = np.loadtxt([row.decode("ascii") for row in rows], ndmin=2, comments=None)
        except (ValueError, UserWarning, RecursionError) as error:
            reason = str(error).splitlines()[0]
            raise InputError(f"{self.path}: element '{name}' is damaged: {reason}") from None
        return self._table(name, element, numbers)

    def _table(self, name: str, element: _Element, numbers: NDArray[np.float64]) -> Table:
        """Structured rows; a list has one column for its length before its items'."""
        fields: list[tuple[Any, ...]] = []
        used: list[int] = []
        at = 0
        for one, kind in element.properties.items():
            length = 1
            if not isinstance(kind, str) and at < numbers.shape[1]:
                length = int(numbers[0, at]) if 0 <= numbers[0, at] <= numbers.shape[1] else -1
                if (numbers[:, at] != length).any():
                    raise InputError(f"{self.path}: lists '{one}' of '{name}' differ in length")
                at += 1
            fields.append((one, "f8") if isinstance(kind, str) else (one, "f8", (length,)))
            used += range(at, at + length)
            at += length
        if at != numbers.shape[1]:
            raise InputError(
                f"{self.path}: rows of '{name}' have {numbers.shape[1]} numbers, expected {at}"
            )
        table = np.zeros(len(numbers), fields)
        columns_left = iter(used)
        for field in fields:
            shape = field[2] if len(field) == 3 else ()
            chosen = [next(columns_left) for _ in range(int(np.prod(shape)))]
            table[field[0]] = numbers[:, chosen].reshape(len(numbers), *shape)
        return table


_LENGTH = "length of "
"""Start of the names of fields that hold the lengths of lists."""


def _truncated(path: Path, name: str, count: int, need: str, there: str) -> InputError:
    return InputError(
        f"{path}: is truncated: {count} rows of '{name}' need {need}, there are {there}"
    )

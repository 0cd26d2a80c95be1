"""Elements of any PLY file as numpy tables.

Open3D's reader ends the process at some damaged files; trimesh refuses meshes of mixed polygons.
"""

from __future__ import annotations

import os
import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from airground.errors import InputError
from airground.io.input_files import MIB, MODEL_LIMIT, check_file

Table = NDArray[Any]
"""(N,) structured array: a field for each property of an element, by its name in the header."""

_TYPES = {"char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2"}
_TYPES |= {"int": "i4", "uint": "u4", "float": "f4", "double": "f8"}
_TYPES |= {"int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2"}
_TYPES |= {"int32": "i4", "uint32": "u4", "float32": "f4", "float64": "f8"}
_ORDERS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
_MOST_LINES = 1000
"""Lines of the longest header."""
_HEADER_LIMIT = MIB
"""Longest header [byte]."""
_LONGEST_LIST = 1 << 27
"""Most items of a list: rows of more bytes than 2 GiB are no type of numpy."""
_LINE_LIMIT = MIB
"""Longest row in text [byte]; a sparse file is one line without end."""


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
        check_file(path, MODEL_LIMIT)
        with path.open("rb") as file:
            return _read_tables(path, file, wanted)
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from None


def _read_tables(path: Path, file: BinaryIO, wanted: tuple[str, ...]) -> dict[str, Table]:
    """As `read_elements`: no more rows are read than the header claims and the file can hold."""
    data = file.read(_HEADER_LIMIT)
    head, marker, body = data.partition(b"end_header")
    end_of_line = body.find(b"\n")
    if not data.startswith(b"ply") or not marker or end_of_line < 0:
        raise InputError(f"{path}: is no PLY file")
    order, elements = _parse_header(path, head.decode("ascii", "replace"))
    last = max((k for k, name in enumerate(elements) if name in wanted), default=-1)
    start = len(head) + len(marker) + end_of_line + 1
    size = os.fstat(file.fileno()).st_size
    file.seek(start)
    source = _Binary(path, file, order, start, size) if order else _Text(path, file, size)
    tables = {}
    for name, element in list(elements.items())[: last + 1]:
        table = source.take(name, element)
        if name in wanted:
            tables[name] = table
    if last == len(elements) - 1 and source.goes_on():
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
    """Rows of bytes in a file of `size` bytes; `start` is that of the next row."""

    path: Path
    file: BinaryIO
    order: str
    start: int
    size: int

    def goes_on(self) -> bool:
        """Whether there are bytes that no row has taken."""
        return self.start < self.size

    def take(self, name: str, element: _Element) -> Table:
        kind = self._row_type(element)
        if element.count == 0 or kind.itemsize == 0:
            return np.zeros(0, kind)
        need, there = element.count * kind.itemsize, self.size - self.start
        data = self._bytes(self.start, need) if need <= there else b""
        if len(data) < need:
            raise _truncated(self.path, name, element.count, f"{need} bytes", f"{there}")
        table = np.frombuffer(data, kind, element.count)
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
                first = self._bytes(at, length_type.itemsize)
                whole = element.count > 0 and len(first) == length_type.itemsize
                length = int(np.frombuffer(first, length_type)[0]) if whole else 0
                if not 0 <= length <= min(self.size - at, _LONGEST_LIST):
                    raise InputError(f"{self.path}: a list '{name}' has a length of {length}")
                fields.append((_LENGTH + name, length_type))
                fields.append((name, self.order + kind[1], (length,)))
            at = self.start + np.dtype(fields).itemsize
        return np.dtype(fields)

    def _bytes(self, start: int, count: int) -> bytes:
        self.file.seek(start)
        return self.file.read(count)


class _Text:
    """Lines of text in a file of `size` bytes, read one after the other."""

    def __init__(self, path: Path, file: BinaryIO, size: int) -> None:
        self.path, self.file, self.size = path, file, size

    def goes_on(self) -> bool:
        """Whether there is text that no row has taken."""
        while piece := self.file.read(MIB):
            if piece.strip():
                return True
        return False

    def take(self, name: str, element: _Element) -> Table:
        # At least a digit and a separator for each number; the last may lack its own.
        fewest = element.count * max(1, 2 * len(element.properties)) - 1
        there = self.size - self.file.tell()
        if fewest > there:
            need = f"at least {fewest} bytes"
            raise _truncated(self.path, name, element.count, need, f"{there}")
        rows = [self._line(name, element, number) for number in range(element.count)]
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

    def _line(self, name: str, element: _Element, number: int) -> bytes:
        line = self.file.readline(_LINE_LIMIT + 1)
        if not line:
            there = f"{number} lines"
            raise _truncated(self.path, name, element.count, "a line each", there)
        if len(line) > _LINE_LIMIT:
            raise InputError(f"{self.path}: a row of '{name}' has more than {_LINE_LIMIT} bytes")
        return line.rstrip(b"\r\n")

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

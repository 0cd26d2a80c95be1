"""Files of arrays (`.npz`) that users hand in."""

from __future__ import annotations

import math
import zipfile
import zlib
from pathlib import Path
from tokenize import TokenError
from typing import IO, Any

from numpy.lib import format as npy
from numpy.typing import NDArray

from airground.io.input_files import MIB, TEXT_LIMIT, check_file
from airground.io.input_limits import how_to_raise, raised

UNREADABLE_ARRAYS = (
    OSError,
    EOFError,
    ValueError,
    OverflowError,
    NotImplementedError,  # compressed or encrypted in a way that zipfile does not know
    RuntimeError,
    SyntaxError,  # the header of an array
    TokenError,
    zipfile.BadZipFile,
    zlib.error,
)
"""What `read_arrays` raises for a file that is missing, damaged, or no file of arrays."""
_RATIO, _FLOOR = 100, 64 * MIB
"""Arrays may inflate to so many times the size of their file, or to this [byte]: motions and
pictures have ratios below 10."""
_HEADERS = {(1, 0): npy.read_array_header_1_0, (2, 0): npy.read_array_header_2_0}
"""Readers of the versions of an array's header that numpy writes for numbers and text."""


def read_arrays(path: Path) -> dict[str, NDArray[Any]]:
    """All arrays of a file by name; raises `UNREADABLE_ARRAYS`.

    No more is read than an input may have: a small file can hold huge arrays, or claim them.
    """
    check_file(path)
    with zipfile.ZipFile(path) as archive:
        members = archive.infolist()
        size = sum(member.file_size for member in members)
        if size > raised(TEXT_LIMIT):
            raise ValueError(
                f"its arrays have {size} bytes, expected at most {raised(TEXT_LIMIT)}"
                f"{how_to_raise(size, TEXT_LIMIT)}"
            )
        if size > raised(max(_FLOOR, _RATIO * path.stat().st_size)):
            raise ValueError(
                f"its arrays inflate to {size} bytes, more than {_RATIO} times its own size"
            )
        return {one.filename.removesuffix(".npy"): _read_array(archive, one) for one in members}


def _read_array(archive: zipfile.ZipFile, member: zipfile.ZipInfo) -> NDArray[Any]:
    with archive.open(member) as file:
        _check_header(file, member)
        file.seek(0)
        array: NDArray[Any] = npy.read_array(file, allow_pickle=False)
        return array


def _check_header(file: IO[bytes], member: zipfile.ZipInfo) -> None:
    """ValueError unless an array has the size that its header claims: numpy would allocate that."""
    version = npy.read_magic(file)
    if version not in _HEADERS:
        raise ValueError(f"array {member.filename[:60]!r} has a header of version {version}")
    shape, _, dtype = _HEADERS[version](file)
    if dtype.hasobject:
        raise ValueError(f"array {member.filename[:60]!r} holds Python objects")
    claimed, there = math.prod(shape) * dtype.itemsize, member.file_size - file.tell()
    if claimed != there or min(shape, default=0) < 0 or dtype.itemsize == 0:
        raise ValueError(
            f"array {member.filename[:60]!r} claims shape {shape} of {dtype}, {claimed} bytes; "
            f"there are {there}"
        )

"""Files of arrays (`.npz`) that users hand in."""

from __future__ import annotations

import zipfile
import zlib
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from airground.io.input_files import TEXT_LIMIT, check_file

UNREADABLE_ARRAYS = (
    OSError,
    EOFError,
    ValueError,
    OverflowError,
    NotImplementedError,  # compressed or encrypted in a way that zipfile does not know
    RuntimeError,
    SyntaxError,  # the header of an array
    zipfile.BadZipFile,
    zlib.error,
)
"""What `read_arrays` raises for a file that is missing, damaged, or no file of arrays."""


def read_arrays(path: Path) -> dict[str, NDArray[Any]]:
    """All arrays of a file by name; raises `UNREADABLE_ARRAYS`.

    No more is read than an input may have: a small file can hold huge arrays.
    """
    check_file(path)
    with zipfile.ZipFile(path) as archive:
        size = sum(member.file_size for member in archive.infolist())
    if size > TEXT_LIMIT:
        raise ValueError(f"its arrays have {size} bytes, expected at most {TEXT_LIMIT}")
    with np.load(path, allow_pickle=False) as file:
        return {name: file[name] for name in file.files}

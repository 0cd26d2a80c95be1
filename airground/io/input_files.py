"""The gate for files that users hand in: regular files of bounded size, and nothing else.

A pipe would wait for ever, a device never ends, and a sparse file fills the memory.
"""

from __future__ import annotations

import errno
import re
import stat
import tomllib
from pathlib import Path
from typing import Any

from airground.io.input_limits import how_to_raise, raised

MIB = 1 << 20
# `raised` multiplies these.
SETTINGS_LIMIT = 4 * MIB
"""Largest file of settings or calibration: a thousand times what they need."""
TEXT_LIMIT = 1024 * MIB
"""Largest list of samples or stamps: an IMU at 1 kHz writes 400 MiB an hour."""
IMAGE_LIMIT = 256 * MIB
"""Largest image file: 8192 x 8192 pixels of 32 bits, not compressed."""
MODEL_LIMIT = 8192 * MIB
"""Largest mesh, point cloud or table: more does not fit the memory of most machines."""
_KINDS = {
    stat.S_ISDIR: "a folder",
    stat.S_ISFIFO: "a pipe",
    stat.S_ISCHR: "a device",
    stat.S_ISBLK: "a device",
    stat.S_ISSOCK: "a socket",
}
_DEEP_KEY = re.compile(r"""(?<![\w-])(?:(?:[\w-]+|"[^"\n]*"|'[^'\n]*')[ \t]*\.[ \t]*){64}""")
"""A dotted key of so many levels."""


def read_bytes(path: Path, limit: int) -> bytes:
    """All of a file.

    Args:
        path: File, or a link to one.
        limit: Largest size [byte], unless the user raises all limits.

    Raises:
        OSError: It is missing, cannot be read, is no regular file, or is larger.
    """
    check_file(path, limit)
    return path.read_bytes()


def read_text(path: Path, limit: int) -> str:
    """All of a text file; raises as `read_bytes`, and UnicodeDecodeError.

    OSError at the first zero byte, too: a sparse file below the limit would take many times its
    size as lines.
    """
    check_file(path, limit)
    data = bytearray()
    with path.open("rb") as file:
        while piece := file.read(MIB):
            if 0 in piece:
                raise OSError(errno.EINVAL, "has a zero byte, expected text in UTF-8", str(path))
            data += piece
    return data.decode("utf-8").replace("\r\n", "\n")


def read_toml_text(path: Path) -> dict[str, Any]:
    """A TOML file's tables.

    Raises:
        OSError: As `read_bytes`.
        ValueError: It is no TOML.
    """
    return parse_toml(read_text(path, SETTINGS_LIMIT))


def parse_toml(text: str) -> dict[str, Any]:
    """A text's tables; raises ValueError where it is no TOML or nested too deep."""
    if _DEEP_KEY.search(text):  # tomllib takes minutes over ten thousands of levels
        raise ValueError("a key has more than 64 levels")
    try:
        return tomllib.loads(text)
    except RecursionError:
        raise ValueError("nested too deep") from None


def check_file(path: Path, limit: int = MODEL_LIMIT) -> None:
    """Before a library opens a file: raises OSError as `read_bytes`."""
    status = path.stat()
    if not stat.S_ISREG(status.st_mode):
        kinds = [name for is_kind, name in _KINDS.items() if is_kind(status.st_mode)]
        kind = kinds[0] if kinds else "no file"
        raise OSError(errno.EINVAL, f"is {kind}, expected a file", str(path))
    size = status.st_size
    if size > raised(limit):
        most = f"{size / MIB:.0f} MiB, expected at most {raised(limit) / MIB:.0f}"
        raise OSError(errno.EFBIG, f"has {most}{how_to_raise(size, limit)}", str(path))

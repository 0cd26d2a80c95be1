"""Compressed parts of bags, inflated up to a limit: a small one can hold more than the memory.

The library takes its decompressors from tables of its modules, which `bound_inflating` changes.
"""

from __future__ import annotations

import bz2
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache, partial
from types import SimpleNamespace
from typing import Any, BinaryIO, Literal

from lz4.frame import LZ4FrameDecompressor  # type: ignore[import-untyped]
from rosbags.rosbag1 import reader as rosbag1
from rosbags.rosbag2 import reader as rosbag2
from rosbags.rosbag2 import storage_mcap

from airground.io.input_limits import how_to_raise, raised

zstd = storage_mcap.zstd
"""The module of Python 3.14, or what stands for it in versions before."""
CHUNK_LIMIT = 256 << 20
"""Largest chunk or message once it is inflated [byte]: that of an image; most have about 1 MiB."""
FILE_RATIO = 100
"""A compressed file may inflate to so many times its size ..."""
FILE_FLOOR = 1 << 30
"""... or to this [byte], whichever is more: it is written to the folder for temporary files."""


@cache
def bound_inflating() -> None:
    """Make the library's readers of bags raise ValueError where a part inflates to too much."""
    kinds: dict[str, Callable[[], Any]] = {
        "zstd": zstd.ZstdDecompressor,
        "lz4": LZ4FrameDecompressor,
        "bz2": bz2.BZ2Decompressor,
    }
    for name in ("zstd", "lz4"):
        storage_mcap.DECOMPRESSORS[name] = partial(_chunk, kinds[name])
    for name in ("lz4", "bz2"):
        rosbag1.decompressors[name] = partial(_chunk, kinds[name])
    of_files = SimpleNamespace(decompress=partial(_chunk, kinds["zstd"]), open=_bounded_file)
    rosbag2.zstd = of_files  # type: ignore[assignment]


def _chunk(kind: Callable[[], Any], data: bytes, stated: int | None = None) -> bytes:
    """`data` inflated; `stated` is the size that the bag states [byte], None where it does not."""
    limit = raised(CHUNK_LIMIT)
    if stated is not None and stated > limit:
        raise ValueError(
            f"a chunk states {stated} bytes, expected at most {limit}"
            f"{how_to_raise(stated, CHUNK_LIMIT)}"
        )
    return inflated(kind, data, limit if stated is None else stated)


def inflated(kind: Callable[[], Any], data: bytes, limit: int) -> bytes:
    """All frames of compressed data, one after the other.

    Args:
        kind: Makes a decompressor of `bz2`, `lz4.frame` or `zstd`.
        data: Compressed data.
        limit: Largest size once inflated [byte].

    Raises:
        ValueError: It is larger, or truncated.
    """
    parts, size = [], 0
    while data:
        decompressor = kind()
        part = decompressor.decompress(data, limit - size + 1)
        parts.append(part)
        size += len(part)
        if size > limit:
            raise ValueError(f"a chunk inflates to more than {limit} bytes")
        if not decompressor.eof:
            raise ValueError("a chunk is truncated")
        data = decompressor.unused_data
    return b"".join(parts)


@contextmanager
def _bounded_file(file: BinaryIO, mode: Literal["rb"]) -> Iterator[SimpleNamespace]:
    """As `zstd.open` of an open file, of which the library only reads."""
    at = file.tell()
    limit = raised(max(FILE_FLOOR, FILE_RATIO * file.seek(0, 2)))
    file.seek(at)
    size = 0
    with zstd.open(file, mode) as inflating:

        def read(length: int = -1) -> bytes:
            nonlocal size
            part: bytes = inflating.read(length)
            size += len(part)
            if size > limit:
                raise ValueError(f"a compressed file inflates to more than {limit} bytes")
            return part

        yield SimpleNamespace(read=read)

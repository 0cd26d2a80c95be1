"""Decoding the PNG images that recordings hold, about twice as fast as libpng does.

Intel's ISA-L inflates them; the filters of the rows are undone here. Only grey of 8 or 16 bits and
RGB of 8 bits, not interlaced, are decoded."""

from __future__ import annotations

import struct
import zlib
from dataclasses import dataclass
from typing import Any

import numpy as np
from isal import isal_zlib
from numba import njit
from numpy.typing import NDArray

from airground.core.arrays import U8

SIGNATURE = b"\x89PNG\r\n\x1a\n"
_GREY, _RGB = 0, 2
_KINDS = {(_GREY, 8): 1, (_GREY, 16): 2, (_RGB, 8): 3}
"""Bytes a pixel by colour type and bits."""


@dataclass(frozen=True)
class PngHeader:
    """Size of an image [px] and its bytes per pixel, None for a kind that is not decoded here."""

    width: int
    height: int
    pixel_bytes: int | None

    @classmethod
    def read(cls, data: bytes) -> PngHeader:
        """From a file's first bytes; ValueError where they are no header."""
        if len(data) < 33 or not data.startswith(SIGNATURE) or data[12:16] != b"IHDR":
            raise ValueError("the PNG image has no header")
        if zlib.crc32(data[12:29]) != int.from_bytes(data[29:33], "big"):
            raise ValueError("the PNG image is damaged: its header has another checksum")
        width, height, bits, colour, *methods = struct.unpack(">IIBBBBB", data[16:29])
        return cls(width, height, None if any(methods) else _KINDS.get((colour, bits)))

    @property
    def row_bytes(self) -> int:
        """Bytes per row without the number of its filter."""
        assert self.pixel_bytes is not None
        return self.width * self.pixel_bytes


def decode_png(data: bytes) -> NDArray[Any]:
    """The image in a PNG file: (height, width) uint8 or uint16, or (height, width, 3) uint8 RGB.

    Raises:
        ValueError: The file is damaged, or of a kind that is not decoded here.
    """
    header = PngHeader.read(data)
    if header.pixel_bytes is None:
        raise ValueError("this kind of PNG image is not decoded here")
    size = header.height * (1 + header.row_bytes)
    # No more than the header promises, so that a small file cannot fill the memory.
    inflater = isal_zlib.decompressobj()
    try:
        raw = inflater.decompress(_image_data(data), size + 1)
    except isal_zlib.error as error:  # type: ignore[misc]  # its stub calls it an instance
        raise ValueError(f"the PNG image is damaged: {error}") from error
    if len(raw) != size or not inflater.eof:
        raise ValueError("the PNG image is damaged: its data end at the wrong place")
    filtered = np.frombuffer(raw, np.uint8).reshape(header.height, 1 + header.row_bytes)
    rows = np.empty((header.height, header.row_bytes), np.uint8)
    if not undo_filters(filtered, rows, header.pixel_bytes):
        raise ValueError("the PNG image is damaged: it has a filter of no known kind")
    if header.pixel_bytes == 2:
        return rows.view(">u2").astype(np.uint16)
    return rows if header.pixel_bytes == 1 else rows.reshape(header.height, header.width, 3)


def warm_up_decoding() -> None:
    """Compile what decoding needs."""
    undo_filters(np.zeros((1, 2), np.uint8), np.empty((1, 1), np.uint8), 1)


def _image_data(data: bytes) -> bytes:
    """All of the image's compressed bytes, from as many chunks as there are."""
    chunks = []
    at = len(SIGNATURE)
    while at + 8 <= len(data):
        length = int.from_bytes(data[at : at + 4], "big")
        if data[at + 4 : at + 8] == b"IDAT":
            chunks.append(data[at + 8 : at + 8 + length])
        at += 12 + length
    return b"".join(chunks)


@njit(cache=True, nogil=True)
def undo_filters(filtered: U8, rows: U8, pixel_bytes: int) -> bool:
    """Undo what was subtracted from each byte before it was compressed (PNG specification, 9).

    Args:
        filtered: (height, 1 + row) uint8, each row after the number of its filter.
        rows: (height, row) uint8, written.
        pixel_bytes: Number of bytes per pixel.

    Returns:
        False where a filter's number has no meaning.
    """
    for y in range(len(rows)):
        kind, line, row = filtered[y, 0], filtered[y, 1:], rows[y]
        if kind > 4:
            return False
        if kind == 0 or (kind == 2 and y == 0):
            row[:] = line
        elif kind == 1:
            _add_left(line, row, pixel_bytes)
        elif kind == 2:
            _add_above(line, rows[y - 1], row)
        else:
            above = rows[y - 1] if y > 0 else np.zeros_like(row)
            _add_guess(line, above, row, pixel_bytes, kind == 3)
    return True


@njit(cache=True, nogil=True)
def _add_left(line: U8, row: U8, pixel_bytes: int) -> None:
    """Filter 1, which our colour images use: sums of as many channels side by side."""
    if pixel_bytes == 3:
        red = green = blue = 0
        for x in range(0, len(row), 3):
            red, green, blue = red + line[x], green + line[x + 1], blue + line[x + 2]
            row[x], row[x + 1], row[x + 2] = red & 255, green & 255, blue & 255
    elif pixel_bytes == 2:
        first = second = 0
        for x in range(0, len(row), 2):
            first, second = first + line[x], second + line[x + 1]
            row[x], row[x + 1] = first & 255, second & 255
    else:
        value = 0
        for x in range(len(row)):
            value += line[x]
            row[x] = value & 255


@njit(cache=True, nogil=True)
def _add_above(line: U8, above: U8, row: U8) -> None:
    """Filter 2, which our grey and depth images use."""
    for x in range(len(row)):
        row[x] = (line[x] + above[x]) & 255


@njit(cache=True, nogil=True)
def _add_guess(line: U8, above: U8, row: U8, pixel_bytes: int, mean: bool) -> None:
    """Filters 3, the mean of left and above, and 4, the nearest of left, above and corner."""
    for channel in range(pixel_bytes):
        left, corner = 0, 0
        for x in range(channel, len(row), pixel_bytes):
            over = int(above[x])
            guess = (left + over) // 2 if mean else _nearest(left, over, corner)
            left, corner = (int(line[x]) + guess) & 255, over
            row[x] = left


@njit(cache=True, nogil=True, inline="always")
def _nearest(left: int, above: int, corner: int) -> int:
    """Paeth's choice: the neighbour that is nearest to left + above - corner."""
    guess = left + above - corner
    off_left, off_above, off_corner = abs(guess - left), abs(guess - above), abs(guess - corner)
    if off_left <= off_above and off_left <= off_corner:
        return left
    return above if off_above <= off_corner else corner

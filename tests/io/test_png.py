"""Decoding of PNG images against OpenCV, which decodes them by libpng."""

from __future__ import annotations

import struct
import zlib
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from airground.errors import RecordingError
from airground.io.images import read_colour, read_grey, read_units
from airground.io.png import SIGNATURE, decode_png, undo_filters

FILTERS = (
    cv2.IMWRITE_PNG_FILTER_NONE,
    cv2.IMWRITE_PNG_FILTER_SUB,
    cv2.IMWRITE_PNG_FILTER_UP,
    cv2.IMWRITE_PNG_FILTER_AVG,
    cv2.IMWRITE_PNG_FILTER_PAETH,
    cv2.IMWRITE_PNG_ALL_FILTERS,
)


def picture(kind: str, height: int = 37, width: int = 53) -> NDArray:
    """Smooth with some noise, so that every filter is worth choosing somewhere."""
    rng = np.random.default_rng(3)
    rows, columns = np.mgrid[:height, :width]
    level = 90 + 60 * np.sin(columns / 7) * np.cos(rows / 5) + rng.normal(0, 4, (height, width))
    match kind:
        case "grey":
            return level.astype(np.uint8)
        case "depth":
            return (level * 201).astype(np.uint16)
        case _:
            return np.stack([level, level * 0.7, 200 - level], axis=-1).astype(np.uint8)


def as_rgb(image: NDArray) -> NDArray:
    return image[..., ::-1] if image.ndim == 3 else image


def by_hand(width: int, height: int, data: bytes, colour: int = 0, bits: int = 8) -> bytes:
    """A file put together chunk by chunk."""

    def chunk(name: bytes, body: bytes) -> bytes:
        return (
            struct.pack(">I", len(body)) + name + body + struct.pack(">I", zlib.crc32(name + body))
        )

    header = struct.pack(">IIBBBBB", width, height, bits, colour, 0, 0, 0)
    return SIGNATURE + chunk(b"IHDR", header) + chunk(b"IDAT", data) + chunk(b"IEND", b"")


@pytest.mark.kernel
@pytest.mark.parametrize("kind", ["grey", "depth", "colour"])
@pytest.mark.parametrize("filters", FILTERS)
def test_every_kind_and_filter_is_decoded_as_opencv_does(kind: str, filters: int) -> None:
    packed = cv2.imencode(".png", picture(kind), [cv2.IMWRITE_PNG_FILTER, filters])[1]
    expected = as_rgb(cv2.imdecode(packed, cv2.IMREAD_UNCHANGED))
    decoded = decode_png(packed.tobytes())
    assert decoded.dtype == expected.dtype
    np.testing.assert_array_equal(decoded, expected)


@pytest.mark.kernel
@settings(deadline=None)  # the first example compiles
@given(st.integers(0, 2**32 - 1), st.integers(1, 3))
def test_filters_are_undone_as_the_specification_says(seed: int, pixel_bytes: int) -> None:
    rng = np.random.default_rng(seed)
    height, width = rng.integers(1, 5), rng.integers(1, 6) * pixel_bytes
    filtered = rng.integers(0, 256, (height, 1 + width), np.uint8)
    filtered[:, 0] %= 5
    rows = np.empty((height, width), np.uint8)
    assert undo_filters(filtered, rows, pixel_bytes)
    np.testing.assert_array_equal(rows, slowly(filtered, pixel_bytes))


def slowly(filtered: NDArray, pixel_bytes: int) -> NDArray:
    """The specification's equations, byte by byte on a frame of zeros."""
    height, width = len(filtered), filtered.shape[1] - 1
    out = np.zeros((height + 1, pixel_bytes + width), int)
    for y in range(height):
        for x in range(width):
            a, b = out[y + 1, x], out[y, pixel_bytes + x]
            c = out[y, x]
            paeth = min((a, b, c), key=lambda one, p=a + b - c: abs(p - one))
            guess = (0, a, b, (a + b) // 2, paeth)[filtered[y, 0]]
            out[y + 1, pixel_bytes + x] = (int(filtered[y, 1 + x]) + guess) % 256
    return out[1:, pixel_bytes:].astype(np.uint8)


def test_data_in_many_chunks_are_joined() -> None:
    image = picture("grey", 480, 752)
    packed = cv2.imencode(".png", image)[1].tobytes()
    assert packed.count(b"IDAT") > 1
    np.testing.assert_array_equal(decode_png(packed), image)


@pytest.mark.parametrize("at", [0.3, 0.6, 0.9])
def test_a_flipped_bit_is_noticed(at: float) -> None:
    packed = bytearray(cv2.imencode(".png", picture("grey"))[1].tobytes())
    packed[int(at * len(packed))] ^= 4
    with pytest.raises(ValueError, match="damaged"):
        decode_png(bytes(packed))


@pytest.mark.parametrize("place", [18, 24, 28, 30])  # width, bits, interlacing, checksum
def test_a_changed_header_is_noticed(
    tmp_path: Path, place: int, capfd: pytest.CaptureFixture
) -> None:
    packed = bytearray(by_hand(4, 2, zlib.compress(bytes(10))))
    packed[place] ^= 1
    (tmp_path / "a.png").write_bytes(packed)
    with pytest.raises(RecordingError, match="its header has another checksum"):
        read_grey(tmp_path / "a.png", 4, 2)
    assert capfd.readouterr().err == ""  # libpng would print


def test_data_without_their_end_are_noticed() -> None:
    """All rows are there, but not the checksum."""
    with pytest.raises(ValueError, match="wrong place"):
        decode_png(by_hand(4, 2, zlib.compress(bytes(10))[:-4]))


def test_an_unknown_filter_is_noticed() -> None:
    with pytest.raises(ValueError, match="filter"):
        decode_png(by_hand(1, 1, zlib.compress(bytes([5, 0]))))


@pytest.mark.parametrize("rows", [1, 3])
def test_too_few_or_too_many_rows_are_noticed(rows: int) -> None:
    with pytest.raises(ValueError, match="wrong place"):
        decode_png(by_hand(4, 2, zlib.compress(bytes(5 * rows))))


def test_a_small_file_cannot_fill_the_memory(tmp_path: Path) -> None:
    bomb = tmp_path / "bomb.png"
    bomb.write_bytes(by_hand(8, 8, zlib.compress(bytes(10**8))))
    with pytest.raises(RecordingError, match="wrong place"):
        read_grey(bomb, 8, 8)


def test_a_huge_header_is_refused_before_anything_is_allocated(tmp_path: Path) -> None:
    huge = tmp_path / "huge.png"
    huge.write_bytes(by_hand(2**31 - 1, 2**31 - 1, zlib.compress(b"")))
    with pytest.raises(RecordingError, match="2147483647x2147483647"):
        read_grey(huge, 8, 8)


def test_other_kinds_are_left_to_opencv(tmp_path: Path) -> None:
    """A palette image: colour type 3."""
    from PIL import Image

    image = picture("colour")
    file = tmp_path / "palette.png"
    palette = Image.fromarray(image).convert("P", palette=Image.Palette.ADAPTIVE)
    palette.save(file)
    expected = np.asarray(palette.convert("RGB"))
    np.testing.assert_array_equal(read_colour(file, image.shape[1], image.shape[0]), expected)


@pytest.mark.parametrize("bits", [1, 2, 4])
@pytest.mark.parametrize("interlaced", [False, True])
def test_grey_of_few_bits_and_interlaced(tmp_path: Path, bits: int, interlaced: bool) -> None:
    """As OpenCV decodes them: 0 is black, the largest value white."""
    level = np.arange(24, dtype=np.uint8).reshape(4, 6) % 2**bits
    if interlaced:  # one pixel, which all passes but the first leave out
        level = level[:1, 1:2]
    rows = np.packbits(
        np.unpackbits(level[..., None], axis=2)[..., -bits:].reshape(len(level), -1), 1
    )
    raw = b"".join(b"\0" + row.tobytes() for row in rows)
    height, width = level.shape
    size = struct.pack(">IIBBBBB", width, height, bits, 0, 0, 0, int(interlaced))
    chunks = (b"IHDR", size), (b"IDAT", zlib.compress(raw)), (b"IEND", b"")
    file = tmp_path / "grey.png"
    file.write_bytes(b"\x89PNG\r\n\x1a\n" + b"".join(map(chunk, chunks)))
    expected = cv2.imread(str(file), cv2.IMREAD_UNCHANGED)
    np.testing.assert_array_equal(read_grey(file, width, height), expected)
    np.testing.assert_array_equal(expected, level * (255 // (2**bits - 1)))


def chunk(one: tuple[bytes, bytes]) -> bytes:
    body = b"".join(one)
    return struct.pack(">I", len(one[1])) + body + struct.pack(">I", zlib.crc32(body))


@pytest.mark.parametrize("kind", [(1, 3), (16, 2), (8, 6), (2, 0), (16, 4)])
def test_what_is_wrong_with_another_kind_is_not_written_to_the_screen(
    kind: tuple[int, int], tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    size = struct.pack(">IIBBBBB", 6, 4, *kind, 0, 0, 0)
    chunks = (b"IHDR", size), (b"IDAT", zlib.compress(bytes([9]) * 40)), (b"IEND", b"")
    file = tmp_path / "a.png"
    file.write_bytes(b"\x89PNG\r\n\x1a\n" + b"".join(map(chunk, chunks)))
    with pytest.raises(RecordingError) as caught:
        read_grey(file, 6, 4)
    assert "\n" not in str(caught.value)
    assert capfd.readouterr() == ("", "")


def adam7(image: NDArray[Any], bits: int, colour_type: int) -> bytes:
    """An interlaced PNG file by hand: each pass is a small image."""
    starts = [(0, 0, 8, 8), (0, 4, 8, 8), (4, 0, 8, 4), (0, 2, 4, 4), (2, 0, 4, 2)]
    starts += [(0, 1, 2, 2), (1, 0, 2, 1)]
    passes = [image[y::dy, x::dx] for y, x, dy, dx in starts]
    raw = b"".join(b"\0" + row.tobytes() for one in passes if one.size for row in one)
    height, width = image.shape[:2]
    size = struct.pack(">IIBBBBB", width, height, bits, colour_type, 0, 0, 1)
    chunks = (b"IHDR", size), (b"IDAT", zlib.compress(raw)), (b"IEND", b"")
    return b"\x89PNG\r\n\x1a\n" + b"".join(map(chunk, chunks))


@pytest.mark.parametrize("colour", [False, True])
def test_interlaced_images(tmp_path: Path, colour: bool) -> None:
    shape = (9, 11, 3) if colour else (9, 11)
    image = np.random.default_rng(0).integers(0, 256, shape, np.uint8)
    file = tmp_path / "a.png"
    file.write_bytes(adam7(image, 8, 2 if colour else 0))
    read = read_colour if colour else read_grey
    np.testing.assert_array_equal(read(file, 11, 9), image)


def test_interlaced_depth(tmp_path: Path) -> None:
    depth_mm = np.random.default_rng(0).integers(0, 65536, (9, 11), np.uint16)
    file = tmp_path / "a.png"
    file.write_bytes(adam7(depth_mm.astype(">u2"), 16, 0))
    np.testing.assert_array_equal(read_units(file, 11, 9), depth_mm)

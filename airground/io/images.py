"""Decoding the images of a recording, with every complaint that they may deserve."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from airground.errors import RecordingError

_PNG_START = b"\x89PNG\r\n\x1a\n"
_PNG_END = b"IEND\xaeB`\x82"


def read_grey(path: Path, width: int, height: int) -> NDArray[np.uint8]:
    """(height, width) uint8; raises RecordingError naming the file."""
    return _read(path, (height, width), np.uint8)


def read_colour(path: Path, width: int, height: int) -> NDArray[np.uint8]:
    """(height, width, 3) uint8 RGB; raises RecordingError naming the file."""
    bgr = _read(path, (height, width, 3), np.uint8)
    return np.asarray(cv2.cvtColor(bgr, cv2.COLOR_BGR2RGB), np.uint8)


def read_depth(path: Path, width: int, height: int, units_per_m: float) -> NDArray[np.float32]:
    """(height, width) float32 [m], NaN where the file holds 0; raises RecordingError."""
    return metric_depth(_read(path, (height, width), np.uint16), units_per_m)


def metric_depth(units: NDArray[np.uint16], units_per_m: float) -> NDArray[np.float32]:
    """Depth [m] from the values of a depth image; NaN for 0."""
    depth = units.astype(np.float32) / np.float32(units_per_m)
    depth[units == 0] = np.nan
    return depth


def image_size(path: Path) -> tuple[int, int]:
    """Width and height [px], from the file's first bytes; raises RecordingError."""
    return _size(path, _bytes(path))


def _size(path: Path, data: bytes) -> tuple[int, int]:
    if len(data) < 24:
        raise RecordingError(f"{path}: is truncated: the PNG image has no size")
    return int.from_bytes(data[16:20], "big"), int.from_bytes(data[20:24], "big")


def _bytes(path: Path) -> bytes:
    """A file that starts as PNG files do."""
    try:
        data = path.read_bytes()
    except OSError as error:
        raise RecordingError(f"{path}: cannot be read: {error.strerror}") from None
    if not data.startswith(_PNG_START):
        raise RecordingError(f"{path}: is no PNG image")
    return data


def _read(path: Path, shape: tuple[int, ...], dtype: type[np.generic]) -> NDArray:
    data = _bytes(path)
    if not data.endswith(_PNG_END):
        raise RecordingError(f"{path}: is truncated: the PNG image has no end")
    width, height = _size(path, data)
    # Before it is decoded: a few bytes may claim an image that fills the memory.
    if (height, width) != shape[:2]:
        raise RecordingError(
            f"{path}: is {width}x{height}, the calibration says {shape[1]}x{shape[0]}"
        )
    image = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED)
    if image is None:
        raise RecordingError(f"{path}: is damaged: the PNG image cannot be decoded")
    if image.ndim != len(shape) or image.dtype != dtype:
        channels = 1 if image.ndim == 2 else image.shape[2]
        raise RecordingError(
            f"{path}: has {channels} channels of {image.dtype}, "
            f"expected {1 if len(shape) == 2 else shape[2]} of {np.dtype(dtype)}"
        )
    return image

"""Decoding the images of a recording, with errors that name the file and the reason.

Images are PNG files, and colour or grey may be JPEG; the first bytes decide, not the name."""

from __future__ import annotations

import struct
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray
from PIL import UnidentifiedImageError
from PIL.JpegImagePlugin import JpegImageFile
from PIL.PngImagePlugin import PngImageFile

from airground.core.arrays import F32, U8, U16, Scalar
from airground.errors import RecordingError
from airground.io.input_files import IMAGE_LIMIT, read_bytes
from airground.io.input_limits import how_to_raise, raised
from airground.io.png import SIGNATURE, PngHeader, decode_png, warm_up_decoding

PIXEL_LIMIT = 1 << 26
"""Most pixels of an image, unless the user raises all limits; a file of some megabytes can claim
thousands of millions."""
_PNG_END = b"IEND\xaeB`\x82"
_JPEG_START = b"\xff\xd8\xff"
_DEEP, _GREY = 16, 0
"""Bits per channel, and kind of pixels, in bytes 24 and 25 of a PNG file."""
_DAMAGED = (SyntaxError, OSError, EOFError, LookupError, TypeError, ValueError, struct.error)
"""What Pillow raises for a damaged PNG file."""


def read_grey(path: Path, width: int, height: int) -> U8:
    """(height, width) uint8; raises RecordingError naming the file."""
    return _read(path, (height, width), np.uint8)


def read_colour(path: Path, width: int, height: int) -> U8:
    """(height, width, 3) uint8 RGB; raises RecordingError naming the file."""
    return _read(path, (height, width, 3), np.uint8)


def read_depth(path: Path, width: int, height: int, units_per_m: float, missing: int = 0) -> F32:
    """(height, width) float32 [m], NaN where the file holds 0 or `missing`; raises
    RecordingError."""
    units = read_units(path, width, height)
    if missing:
        units = np.where(units == missing, np.uint16(0), units)
    return metric_depth(units, units_per_m)


def read_units(path: Path, width: int, height: int) -> U16:
    """(height, width) uint16 values of a depth image as they are; raises RecordingError."""
    return _read(path, (height, width), np.uint16)


def metric_depth(units: U16, units_per_m: float) -> F32:
    """Depth [m] from the values of a depth image; NaN for 0."""
    depth = np.empty(units.shape, np.float32)
    _to_metres(np.ascontiguousarray(units).reshape(-1), np.float32(units_per_m), depth.reshape(-1))
    return depth


def depth_units(depth: F32, units_per_m: float) -> U16:
    """Values of a depth image of depth [m]; 0 for what is missing or too far for 16 bits."""
    units = depth * np.float32(units_per_m)
    fits = units <= np.iinfo(np.uint16).max  # false where NaN
    return np.where(fits, np.rint(units), 0).astype(np.uint16)


def warm_up_images() -> None:
    """Compile what reading images needs."""
    warm_up_decoding()
    metric_depth(np.zeros((1, 1), np.uint16), 1.0)


@njit(cache=True, nogil=True, error_model="numpy")
def _to_metres(units: U16, units_per_m: np.float32, depth: F32) -> None:
    for i in range(len(units)):
        depth[i] = np.float32(units[i]) / units_per_m if units[i] > 0 else np.float32(np.nan)


def image_size(path: Path) -> tuple[int, int]:
    """Width and height [px], from the file's first bytes; raises RecordingError."""
    data = read_image_bytes(path)
    try:
        return size_of(data)
    except ValueError as error:
        raise RecordingError(f"{path}: is truncated: {error}") from None


def is_image(data: bytes) -> bool:
    """Whether the bytes begin as PNG or JPEG files do."""
    return data.startswith((SIGNATURE, _JPEG_START))


def size_of(data: bytes) -> tuple[int, int]:
    """Width and height [px] of a PNG or JPEG image; ValueError where its header is damaged."""
    if data.startswith(_JPEG_START):
        return _jpeg(data).size
    header = PngHeader.read(data)
    return header.width, header.height


def decode(data: bytes) -> NDArray[Any]:
    """A PNG or JPEG image: grey (H, W), or colour (H, W, C) with RGB first.
    ValueError if it is damaged or larger than `PIXEL_LIMIT`."""
    width, height = size_of(data)
    if width * height > raised(PIXEL_LIMIT):
        more = f"{width}x{height} are more than {raised(PIXEL_LIMIT)} pixels"
        raise ValueError(f"{more}{how_to_raise(width * height, PIXEL_LIMIT)}")
    if data.startswith(_JPEG_START):
        return _decode_jpeg(data)
    if not data.endswith(_PNG_END):
        raise ValueError("the PNG image is truncated: it has no end")
    return decode_png(data) if PngHeader.read(data).pixel_bytes else _decode_any(data)


def read_image_bytes(path: Path) -> bytes:
    """An image file as it is, not decoded; RecordingError where it is no PNG or JPEG file."""
    try:
        data = read_bytes(path, IMAGE_LIMIT)
    except OSError as error:
        raise RecordingError(f"{path}: cannot be read: {error.strerror}") from None
    if not is_image(data):
        raise RecordingError(f"{path}: is no PNG or JPEG image")
    return data


def _read(path: Path, shape: tuple[int, ...], dtype: type[Scalar]) -> NDArray[Scalar]:
    data = read_image_bytes(path)
    try:
        width, height = size_of(data)
        # Before anything is allocated for it.
        if (height, width) != shape[:2]:
            raise RecordingError(
                f"{path}: is {width}x{height}, the calibration says {shape[1]}x{shape[0]}"
            )
        image = decode(data)
    except ValueError as error:
        raise RecordingError(f"{path}: cannot be decoded: {error}") from None
    if image.ndim != len(shape) or image.dtype != dtype:
        channels = 1 if image.ndim == 2 else image.shape[2]
        raise RecordingError(
            f"{path}: has {channels} channels of {image.dtype}, "
            f"expected {1 if len(shape) == 2 else shape[2]} of {np.dtype(dtype)}"
        )
    return image


def _jpeg(data: bytes) -> JpegImageFile:
    """The header, with nothing decoded yet."""
    try:
        return JpegImageFile(BytesIO(data))
    except (SyntaxError, OSError, UnidentifiedImageError, IndexError, KeyError, TypeError) as error:
        raise ValueError(f"the JPEG image is damaged: {error}") from None


def _decode_jpeg(data: bytes) -> NDArray[Any]:
    image = _jpeg(data)
    if image.mode not in ("L", "RGB"):
        raise ValueError(f"the JPEG image has the colour model {image.mode}, expected grey or RGB")
    try:
        return np.asarray(image)  # as the sensor saw it: an orientation for viewers is ignored
    except (SyntaxError, OSError) as error:
        raise ValueError(f"the JPEG image is damaged: {error}") from None


def _decode_any(data: bytes) -> NDArray[Any]:
    """The image in a PNG file of another kind: with a palette, interlaced, or of few bits.
    ValueError if it is damaged. OpenCV would write what is wrong to the screen."""
    if data[24] == _DEEP and data[25] != _GREY:
        raise ValueError("the PNG image has colours of 16 bits, expected 8")
    try:
        image = PngImageFile(BytesIO(data))
        image.load()
        mode = {"1": "L", "P": "RGB"}.get(image.mode)
        return np.asarray(image if mode is None else image.convert(mode))
    except (*_DAMAGED, UnidentifiedImageError) as error:
        raise ValueError(f"the PNG image is damaged: {error}") from None

"""Images in ROS messages: raw, as PNG or JPEG, and depth."""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from airground.core.arrays import F32, U8, U16
from airground.io.images import decode, is_image, metric_depth, size_of

COMPRESSED = "sensor_msgs/msg/CompressedImage"
RAW = "sensor_msgs/msg/Image"
KINDS = (RAW, COMPRESSED)

GREY = ("mono8", "8UC1", "mono16")
COLOUR: dict[str, int | None] = {
    "rgb8": None,
    "8UC3": cv2.COLOR_BGR2RGB,
    "bgr8": cv2.COLOR_BGR2RGB,
    "rgba8": cv2.COLOR_RGBA2RGB,
    "bgra8": cv2.COLOR_BGRA2RGB,
    # OpenCV names a pattern by its second row.
    "bayer_rggb8": cv2.COLOR_BayerBG2RGB,
    "bayer_bggr8": cv2.COLOR_BayerRG2RGB,
    "bayer_gbrg8": cv2.COLOR_BayerGR2RGB,
    "bayer_grbg8": cv2.COLOR_BayerGB2RGB,
}
"""Encodings, and what turns them into RGB."""
CHANNELS = {"rgb8": 3, "8UC3": 3, "bgr8": 3, "rgba8": 4, "bgra8": 4}
MILLIMETRES, METRES = "16UC1", "32FC1"
"""Encodings of depth by REP 118."""
DTYPES = {MILLIMETRES: "u2", "mono16": "u2", METRES: "f4"}
COMPRESSED_DEPTH_HEADER = 12
"""Bytes that the transport `compressedDepth` puts before its PNG image."""


def encoding_of(message: Any, kind: str) -> str:
    """The encoding of a raw image; of a compressed one that of what is in it."""
    if kind == RAW:
        return str(message.encoding)
    return str(message.format).partition(";")[0].strip()


def shows_depth(message: Any, kind: str, topic: str) -> bool:
    """Whether an image message is one of depth."""
    encoding = encoding_of(message, kind)
    if kind == COMPRESSED:
        return encoding in (MILLIMETRES, METRES) or topic.endswith("compressedDepth")
    return encoding in (MILLIMETRES, METRES) or (encoding == "mono16" and "depth" in topic)


def shows_colour(message: Any, kind: str) -> bool:
    """Whether an image message has colours; ValueError where it cannot be decoded."""
    if kind == RAW:
        return message.encoding in COLOUR
    return decode(_bytes(message)).ndim == 3


def pixels(message: Any, kind: str, width: int, height: int) -> U8:
    """Grey (height, width) or RGB (height, width, 3) uint8; ValueError where it is damaged, of
    another size or of an encoding that is not read."""
    if kind == COMPRESSED:
        image = _decoded(message, width, height)
        if image.dtype != np.uint8:
            raise ValueError(f"has pixels of {image.dtype}, expected uint8")
        return image
    encoding = message.encoding
    if encoding not in (*GREY, *COLOUR):
        known = ", ".join([*GREY, *COLOUR])
        raise ValueError(f"has the encoding '{encoding}', which is not read; known: {known}")
    image = _rows(message, width, height, CHANNELS.get(encoding, 1))
    if encoding in GREY:
        return image.astype(np.uint8) if image.dtype == np.uint8 else (image >> 8).astype(np.uint8)
    conversion = COLOUR[encoding]
    return image if conversion is None else np.asarray(cv2.cvtColor(image, conversion), np.uint8)


def depth_units(message: Any, kind: str, width: int, height: int) -> U16 | F32:
    """(height, width) depth as it is in the message: integers of a unit, or metres.
    ValueError as of `pixels`."""
    if kind == COMPRESSED:
        image = _decoded(message, width, height)
        if image.ndim != 2 or image.dtype != np.uint16:
            raise ValueError(f"depth has pixels of {image.dtype}, expected one channel of uint16")
        return image
    if message.encoding not in DTYPES:
        known = ", ".join(DTYPES)
        raise ValueError(f"has the encoding '{message.encoding}', expected depth: {known}")
    return _rows(message, width, height, 1)


def to_metres(units: U16 | F32, units_per_m: float) -> F32:
    """Depth [m], NaN where it is missing (0 or not finite)."""
    if units.dtype == np.uint16:
        return metric_depth(units.astype(np.uint16), units_per_m)
    depth = units.astype(np.float32)
    return np.where(np.isfinite(depth) & (depth > 0), depth, np.float32(np.nan))


def size(message: Any, kind: str) -> tuple[int, int]:
    """Width and height [px]; ValueError where a compressed image is damaged."""
    if kind == RAW:
        return int(message.width), int(message.height)
    return size_of(_bytes(message))


def _bytes(message: Any) -> bytes:
    data = bytes(message.data)
    if not is_image(data) and is_image(data[COMPRESSED_DEPTH_HEADER:]):
        if encoding_of(message, COMPRESSED) == METRES:
            raise ValueError("compressed depth is quantized from 32FC1, which is not read")
        return data[COMPRESSED_DEPTH_HEADER:]
    if not is_image(data):
        raise ValueError(f"is no PNG or JPEG image (format '{message.format}')")
    return data


def _decoded(message: Any, width: int, height: int) -> NDArray[Any]:
    data = _bytes(message)
    _check_size(size_of(data), width, height)  # before anything is allocated for it
    return decode(data)


def _rows(message: Any, width: int, height: int, channels: int) -> NDArray[Any]:
    """(height, width) or (height, width, channels), with the padding of rows cut off."""
    _check_size((message.width, message.height), width, height)
    order = ">" if message.is_bigendian else "<"
    dtype = np.dtype(order + DTYPES.get(message.encoding, "u1"))
    row = width * channels * dtype.itemsize
    if message.step < row or len(message.data) < height * message.step:
        raise ValueError(f"holds {len(message.data)} bytes, expected {height} rows of {row}")
    data = np.asarray(message.data, np.uint8)[: height * message.step]
    rows = np.ascontiguousarray(data.reshape(height, message.step)[:, :row])
    image = rows.view(dtype).astype(dtype.newbyteorder("="), copy=False)
    return image.reshape(height, width, channels) if channels > 1 else image


def _check_size(found: tuple[int, int], width: int, height: int) -> None:
    if found != (width, height):
        raise ValueError(f"is {found[0]}x{found[1]}, the calibration says {width}x{height}")

"""The images of one stamp as SLAM's input."""

from __future__ import annotations

from dataclasses import dataclass

from airground.core.arrays import F32, U8
from airground.errors import InputError
from airground.slam.rolling_shutter import GLOBAL, Shutter


@dataclass(frozen=True, eq=False)
class Frame:
    """One grey image, with depth where there is a depth camera.

    Attributes:
        image: (height, width) grey image.
        depth: (height, width) depth [m], NaN where missing; None without a depth camera.
        shutter: How the camera turned while the rows were taken, as far as it is known.
    """

    stamp_ns: int
    image: U8
    depth: F32 | None = None
    shutter: Shutter = GLOBAL


def require_order(stamp_ns: int, last_ns: int | None) -> None:
    """InputError unless an image is newer than the one before (None: there is none)."""
    if last_ns is not None and stamp_ns <= last_ns:
        raise InputError(
            f"image at {stamp_ns} ns comes after one at {last_ns} ns: stamps must increase"
        )

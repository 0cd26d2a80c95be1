"""One image as SLAM takes it."""

from __future__ import annotations

from dataclasses import dataclass

from airground.core.arrays import F32, U8
from airground.errors import InputError


@dataclass(frozen=True, eq=False)
class Frame:
    """One image as the engine takes it.

    Attributes:
        stamp_ns: Of the image.
        image: (height, width) grey.
        depth: (height, width) [m], NaN where missing; None without a depth camera.
    """

    stamp_ns: int
    image: U8
    depth: F32 | None = None


def require_order(stamp_ns: int, last_ns: int | None) -> None:
    """Refuse an image that is not newer than the one before; None where there is none.

    Raises:
        InputError: It is not.
    """
    if last_ns is not None and stamp_ns <= last_ns:
        raise InputError(
            f"image at {stamp_ns} ns comes after one at {last_ns} ns: stamps must increase"
        )

"""Frame numbers in place of stamps, as in ICL-NUIM and 7-Scenes."""

from __future__ import annotations

import numpy as np

from airground.core.arrays import I64

SECOND_NS = 1_000_000_000
USUAL_RATE_HZ = 30.0
"""Rate of the Kinect and of ICL-NUIM's renderings, taken where a folder states none [Hz]."""


def are_frame_numbers(stamps_ns: I64) -> bool:
    """Whether stamps (N,), read as seconds, count images: whole ones that step by one."""
    whole = (stamps_ns % SECOND_NS == 0).all()
    return bool(len(stamps_ns) > 1 and whole and np.median(np.diff(stamps_ns)) == SECOND_NS)


def stamps_of(numbers: I64, rate_hz: float) -> I64:
    """Stamps (N,) [ns] of the images with these numbers (N,)."""
    stamps_ns: I64 = np.rint(numbers * (SECOND_NS / rate_hz)).astype(np.int64)
    return stamps_ns


def numbers_of(stamps_ns: I64, rate_hz: float) -> I64:
    """The numbers (N,) of the images with these stamps (N,) [ns]."""
    numbers: I64 = np.rint(stamps_ns * (rate_hz / SECOND_NS)).astype(np.int64)
    return numbers

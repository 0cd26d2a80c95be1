"""Memory that was freed, but that the process still holds."""

from __future__ import annotations

import ctypes


def hand_back_memory() -> None:
    """Return the freed memory that was kept to the system, before other work begins."""
    trim = getattr(ctypes.CDLL(None), "malloc_trim", None)  # glibc only
    if trim is not None:
        trim(0)

"""One thread for BLAS where results count to the last bit.

OpenBLAS splits sums by its number of threads. A map that is tracked for minutes magnifies a
difference in the last bit to centimetres.
"""

from __future__ import annotations

import ctypes
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path

import numpy as np

NAMES = ("numpy", "scipy")
"""Packages whose wheels bring an OpenBLAS of their own."""
SUFFIXES = ("64_", "")
"""Endings of its functions, with 64-bit and 32-bit indices."""

Threads = tuple[Callable[[], int], Callable[[int], None]]
"""The function that returns the number of threads, and the one that sets it."""


@contextmanager
def one_blas_thread() -> Iterator[None]:
    """A block, or as a decorator a function, in which BLAS uses one thread. The number that was
    set before is set again; without an OpenBLAS of numpy's or scipy's wheels nothing changes."""
    before = [(put, count) for get, put in _libraries() if (count := get()) != 1]
    for put, _ in before:
        put(1)
    try:
        yield
    finally:
        for put, count in before:
            put(count)


@cache
def _libraries() -> tuple[Threads, ...]:
    packages = Path(np.__file__).parents[1]
    files = [file for name in NAMES for file in packages.glob(f"{name}.libs/*openblas*")]
    found = []
    for file in sorted(files):
        try:  # only what is loaded: another copy would have threads of its own
            library = ctypes.CDLL(str(file), mode=os.RTLD_NOLOAD | os.RTLD_NOW)
        except OSError:
            continue
        for suffix in SUFFIXES:
            get = getattr(library, f"scipy_openblas_get_num_threads{suffix}", None)
            put = getattr(library, f"scipy_openblas_set_num_threads{suffix}", None)
            if get is not None and put is not None:
                put.restype = None
                found.append((get, put))
    return tuple(found)

"""What this machine's memory and arithmetic can do, so that floors can be computed.

Memory: the triad of the STREAM benchmark (McCalpin 1995), a = b + s c, on arrays that fit no
cache; 24 bytes are counted for each element. Arithmetic: float32 multiply-adds on values in
the first-level cache, two operations each. The best of many short tries counts: other
load only slows them down, and seldom all of them.
"""

from __future__ import annotations

import time
from collections.abc import Callable

import numba
import numpy as np
from numba import njit, prange
from numpy.typing import NDArray

from evaluation.bench.row import Speed

TRIAD_ELEMENTS = 6_000_000
"""48 MB an array."""
TRIES = 60
VALUES = 128
"""float32 values that one thread works on: enough to hide how long one multiply-add takes."""
CHAIN = 16
"""Multiply-adds from one load of a value to its store."""
REPEATS = 50_000


@njit(cache=True, parallel=True)
def triad(a: NDArray[np.float64], b: NDArray[np.float64], c: NDArray[np.float64]) -> None:
    """a = b + 3 c."""
    for i in prange(len(a)):
        a[i] = b[i] + 3.0 * c[i]


@njit(cache=True, parallel=True, fastmath={"contract"})
def multiply_add(values: NDArray[np.float32], repeats: int) -> None:
    """Each value times a factor plus a term, CHAIN * repeats times.

    Args:
        values: (tasks, VALUES) float32.
        repeats: How often.
    """
    factor, term = np.float32(0.999), np.float32(0.001)
    for task in prange(len(values)):
        row = values[task]
        for _ in range(repeats):
            for i in range(VALUES):
                x = row[i]
                for _ in range(CHAIN):
                    x = x * factor + term
                row[i] = x


def probe() -> Speed:
    """Measure with as many threads as numba may use; takes about a second."""
    return Speed(_bandwidth(), _arithmetic())


def _bandwidth() -> float:
    a, b, c = np.zeros(TRIAD_ELEMENTS), np.ones(TRIAD_ELEMENTS), np.ones(TRIAD_ELEMENTS)
    return 3 * a.nbytes / _least_s(lambda: triad(a, b, c))


def _arithmetic() -> float:
    values = np.ones((numba.get_num_threads(), VALUES), np.float32)
    return 2 * values.size * CHAIN * REPEATS / _least_s(lambda: multiply_add(values, REPEATS))


def _least_s(call: Callable[[], None]) -> float:
    call()  # compiled, and its pages touched
    times = []
    for _ in range(TRIES):
        started = time.perf_counter()
        call()
        times.append(time.perf_counter() - started)
    return min(times)

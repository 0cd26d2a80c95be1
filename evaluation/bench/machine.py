"""What this machine can do at most, and what else it does while a benchmark runs.
Memory: the triad of the STREAM benchmark (McCalpin 1995). Arithmetic: float32 multiply-adds on
values in the first-level cache. The best of many short tries counts: other load slows them down,
and seldom all of them."""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from typing import NamedTuple

import numba
import numpy as np
import psutil
from numba import njit, prange
from numpy.typing import NDArray

from evaluation.bench.floors import Speed

TRIAD_ELEMENTS = 6_000_000
"""48 MB per array: more than a cache holds."""
TRIES = 60
VALUES = 128
"""float32 values that one thread works on: enough to hide the latency of a multiply-add."""
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
    """Each of the values (tasks, VALUES) times a factor plus a term, CHAIN * repeats times."""
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
    threads = numba.get_num_threads()
    a, b, c = np.zeros(TRIAD_ELEMENTS), np.ones(TRIAD_ELEMENTS), np.ones(TRIAD_ELEMENTS)
    bytes_per_s = 3 * a.nbytes / _least_s(lambda: triad(a, b, c))
    values = np.ones((threads, VALUES), np.float32)
    operations = 2 * values.size * CHAIN * REPEATS
    operations_per_s = operations / _least_s(lambda: multiply_add(values, REPEATS))
    return Speed(threads, bytes_per_s / 1e9, operations_per_s / 1e9)


def _least_s(call: Callable[[], None]) -> float:
    call()  # compiled, and its pages touched
    times = []
    for _ in range(TRIES):
        started = time.perf_counter()
        call()
        times.append(time.perf_counter() - started)
    return min(times)


class LoadAverage(NamedTuple):
    """Mean number of processes that ran or waited to run, this one included."""

    one_minute: float
    five_minutes: float
    fifteen_minutes: float


class LoadMeter:
    """Measures how many cores other programs keep busy from its construction on.
    Processes that this one started count as its own once they have ended."""

    def __init__(self) -> None:
        self._wall_s, self._busy_s, self._own_s = time.monotonic(), _busy_s(), _own_s()

    def other_cores(self) -> float | None:
        """Mean number of cores busy with other programs; None where the system hides it."""
        busy_s = _busy_s()
        if busy_s is None or self._busy_s is None:
            return None
        others_s = busy_s - self._busy_s - (_own_s() - self._own_s)
        return max(0.0, others_s / max(time.monotonic() - self._wall_s, 1e-9))


def _busy_s() -> float | None:
    """Processor time of the whole machine since it was started [s]."""
    try:
        times = psutil.cpu_times()
    except OSError:
        return None
    # Time of guests is part of user's and nice's; waiting for the disk is idle time.
    return times.user + times.nice + times.system + times.irq + times.softirq + times.steal


def _own_s() -> float:
    times = os.times()
    return times.user + times.system + times.children_user + times.children_system

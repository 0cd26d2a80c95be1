"""What else the machine does while a benchmark runs."""

from __future__ import annotations

import os
import time
from pathlib import Path
from typing import NamedTuple

STAT = Path("/proc/stat")
IDLE = (3, 4)
"""Columns of the first line that count time without work: idle, and waiting for the disk."""
GUEST = 8
"""From here on columns count again what others have."""


class LoadAverage(NamedTuple):
    """Processes that ran or wanted to, in the mean over the last minutes."""

    one_minute: float
    five_minutes: float
    fifteen_minutes: float


def load_average() -> LoadAverage:
    """The system's, this process included."""
    return LoadAverage(*os.getloadavg())


class LoadMeter:
    """Says how many cores other programs kept busy since it was made.

    Processes that this one started count as its own once they have ended.
    """

    def __init__(self) -> None:
        self._wall, self._busy, self._own = time.monotonic(), _busy_s(), _own_s()

    def other_cores(self) -> float | None:
        """Cores busy with something else, in the mean; None where nobody counts them."""
        busy = _busy_s()
        if busy is None or self._busy is None:
            return None
        others = busy - self._busy - (_own_s() - self._own)
        return max(0.0, others / max(time.monotonic() - self._wall, 1e-9))


def _busy_s() -> float | None:
    """CPU time of the whole machine since it was started [s]."""
    try:
        first = STAT.read_text(encoding="ascii").splitlines()[0]
    except (OSError, IndexError):
        return None
    ticks = [int(word) for word in first.split()[1:]][:GUEST]
    return sum(n for i, n in enumerate(ticks) if i not in IDLE) / os.sysconf("SC_CLK_TCK")


def _own_s() -> float:
    times = os.times()
    return times.user + times.system + times.children_user + times.children_system

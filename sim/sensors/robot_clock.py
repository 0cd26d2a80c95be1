"""A robot's clock that may have stepped ahead: its stamps, and the times of the motion."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class RobotClock:
    """Stamps of one robot against the time of the motion.

    Attributes:
        steps: Time of each step and its size [ns].
    """

    steps: tuple[tuple[int, int], ...] = ()

    @classmethod
    def stepping(cls, steps: Iterable[tuple[int, int]]) -> RobotClock:
        """The clock with these steps, in any order."""
        return cls(tuple(sorted(steps)))

    def stamps_ns(self, times_ns: NDArray[np.int64]) -> NDArray[np.int64]:
        """(N,) stamps at times (N,) of the motion [ns]."""
        stamps = np.array(times_ns)
        for start_ns, size_ns in self.steps:
            stamps[times_ns >= start_ns] += size_ns
        return stamps

    def times_ns(self, stamps_ns: NDArray[np.int64]) -> NDArray[np.int64]:
        """(N,) times of the motion at stamps (N,) [ns]; no time has a stamp that a step leaves
        out, and it is taken for one before the step."""
        times, ahead_ns = np.array(stamps_ns), 0
        for start_ns, size_ns in self.steps:
            ahead_ns += size_ns
            times[stamps_ns >= start_ns + ahead_ns] -= size_ns
        return times

    def time_ns(self, stamp_ns: int) -> int:
        """Time of the motion at one stamp [ns]."""
        return int(self.times_ns(np.array([stamp_ns], np.int64))[0])

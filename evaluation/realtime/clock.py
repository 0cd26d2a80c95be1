"""What time it is for a robot that lives through a recording."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import Protocol


class Clock(Protocol):
    """Tells the time by the recording's stamps."""

    def now_ns(self) -> int:
        """The stamp that an image taken now would have."""

    def wait_until(self, stamp_ns: int) -> None:
        """Come back when it is `stamp_ns`, at once where that is past."""


@dataclass(frozen=True)
class PlaybackClock:
    """Recorded time that passes as the machine's does, or by a factor faster.

    All processes of a machine share it: it stands on the system's monotonic clock.

    Attributes:
        first_ns: The recording's first stamp.
        started_ns: When that was due, by the monotonic clock.
        rate: Recorded seconds in one second.
    """

    first_ns: int
    started_ns: int
    rate: float

    def now_ns(self) -> int:
        """The stamp that an image taken now would have."""
        return self.first_ns + round((time.monotonic_ns() - self.started_ns) * self.rate)

    def wait_until(self, stamp_ns: int) -> None:
        """Sleep until it is `stamp_ns`."""
        due_ns = self.started_ns + (stamp_ns - self.first_ns) / self.rate
        seconds = (due_ns - time.monotonic_ns()) * 1e-9
        if seconds > 0:
            time.sleep(seconds)

    def passed_ms(self, since_ns: int, until_ns: int) -> float:
        """How long a span of recorded time took here [ms]."""
        return (until_ns - since_ns) * 1e-6 / self.rate

"""How a recording is played at its own rate: the clock, and the limits of the playback."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import Protocol

from evaluation.run.live.radio_link import RadioLimits


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


@dataclass(frozen=True)
class Playback:
    """How a recording is played.

    Attributes:
        rate: Recorded seconds in one second.
        waiting_frames: How many images may wait before each tracker, 30 being a second at 30 Hz:
            adjusting a whole map of ten minutes takes two thirds of that, and what has waited is
            tracked several times as fast as it came.
        frames_under_way: How many tracked frames of each robot may wait before the mapper:
            five seconds at 30 Hz, some 360 MiB when all of it is full.
        radio: What lies between the MAV and the ground robot; None for one computer.
        patience_s: How long the mapper waits for a robot that is silent.
    """

    rate: float = 1.0
    waiting_frames: int = 30
    frames_under_way: int = 150
    radio: RadioLimits | None = None
    patience_s: float = 2.0

    def describe(self) -> str:
        """For labels: how this differs from a run that takes its time."""
        played = "live" if self.rate == 1.0 else f"live, played {self.rate:g} times as fast"
        return played if self.radio is None else f"{played}, radio: {self.radio.describe()}"

    @property
    def jpeg_quality(self) -> int | None:
        """Of the MAV's images as the mapper gets them; None where they are not compressed."""
        return None if self.radio is None else self.radio.jpeg_quality

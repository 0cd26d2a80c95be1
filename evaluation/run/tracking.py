"""Both robots' tracking over a recording: frames, and what the front ends answered."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

import numpy as np

from airground.core.trajectory import Trajectory
from airground.core.work_ahead import run_ahead
from airground.io.recording import Recording
from airground.slam.warm_up import warm_up_slam
from airground.tracking import TrackedFrame, Trackers
from evaluation.run.drops import DropList
from evaluation.run.front_ends import front_ends_for
from evaluation.setup.setups import Setup
from evaluation.table.tracking_log import Tracked

if TYPE_CHECKING:
    from sim.recording.truth import Truth

FRAMES_AHEAD = 30
"""Tracked frames of a robot that may wait for mapping: those of a second at 30 Hz."""


@dataclass(frozen=True)
class TrackingTask:
    """What is to be tracked, and by whom.

    Attributes:
        recording: What both robots sensed.
        truth: Makes the poses of oracles; None where the setup has none.
        setup: Says who tracks.
        seed: Of all that is random.
        drops: Which images to do without.
    """

    recording: Recording
    truth: Truth | None
    setup: Setup
    seed: int
    drops: DropList


@dataclass(frozen=True)
class TrackingReport:
    """What is known when all is tracked.

    Attributes:
        tracked: What the front ends said, by robot ("mav", "ground").
        ground: The ground robot's path as believed at last; None where it has none.
        processor_s, peak_memory_mib: Of tracking in processes of its own, without what they share
            with mapping; else 0.
    """

    tracked: dict[str, Tracked]
    ground: Trajectory | None
    processor_s: float = 0.0
    peak_memory_mib: float = 0.0


class Tracking(Protocol):
    """Tracks both robots; tracking hears nothing of mapping, and so may run ahead of it."""

    def wait_until_ready(self) -> None:
        """Until everything is compiled."""

    def frames(self) -> Iterator[TrackedFrame]:
        """Every image's frame, in order of time."""

    def report(self) -> TrackingReport:
        """To be asked when there are no more frames."""


class TrackingHere:
    """Tracks in this process, in a thread that runs ahead.

    Args:
        task: What to do.
    """

    def __init__(self, task: TrackingTask) -> None:
        recording = task.recording
        self._messages = recording.messages(task.drops.dropped.by_robot())
        rng = front_end_rng(task.seed)
        self._watched = front_ends_for(task.setup, recording, task.truth, rng)
        self._trackers = Trackers(
            recording.mav.calibration, recording.ground.calibration, self._watched.front_ends()
        )

    def wait_until_ready(self) -> None:
        """Compile."""
        warm_up_slam(np.random.default_rng(0))

    def frames(self) -> Iterator[TrackedFrame]:
        """As `Tracking.frames`."""
        yield from run_ahead(self.in_turn(), 2 * FRAMES_AHEAD)

    def in_turn(self) -> Iterator[TrackedFrame]:
        """Frames as they are asked for, none ahead."""
        return self._trackers.frames(self._messages)

    def report(self) -> TrackingReport:
        """As `Tracking.report`."""
        ground = self._trackers.finish()
        return TrackingReport(self._watched.tracked(), ground)


def front_end_rng(seed: int) -> np.random.Generator:
    """Draws what the front ends need; the pipeline has a generator of its own."""
    return np.random.default_rng(seed).spawn(2)[0]

"""Events of a run as others see them: timed from outside, and passed to onlookers."""

from __future__ import annotations

import time
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Protocol

from airground.core.events import (
    Aligned,
    BeliefUpdated,
    CostMapComputed,
    DepthMapMade,
    Event,
    FieldAdded,
    FrameAdded,
    GroundMapExtended,
    HeightMapsMade,
    MapAugmented,
    SurfaceCast,
    VolumeFused,
)
from airground.pipeline import Sighting
from airground.tracking import TrackedFrame


@dataclass(frozen=True, eq=False)
class Seen:
    """One event, and what it came from.

    Attributes:
        event: What happened.
        duration_ms: How long it took; of an event that says how an image was tracked, the
            wait for it.
        frame: The newest image that was tracked, with its pose.
        sighting: The newest aerial surface, with what both robots knew then; None before the
            first, and while a robot is lost.
    """

    event: Event
    duration_ms: float
    frame: TrackedFrame
    sighting: Sighting | None


class Onlooker(Protocol):
    """Watches a run."""

    def see(self, seen: Seen) -> None:
        """Take in one event; called in the order in which they happen."""


class Audience:
    """All who watch a run.

    Args:
        onlookers: They see every event, in this order.
    """

    def __init__(self, onlookers: Sequence[Onlooker]) -> None:
        self._onlookers = onlookers
        self._frame: TrackedFrame | None = None

    def __bool__(self) -> bool:
        return bool(self._onlookers)

    def noted(self, frames: Iterable[TrackedFrame]) -> Iterator[TrackedFrame]:
        """The frames as they go by."""
        for self._frame in frames:
            yield self._frame

    def show(self, event: Event, duration_ms: float, sighting: Sighting | None) -> None:
        """Let everyone see an event of the newest frame, while no stage runs."""
        assert self._frame is not None
        for onlooker in self._onlookers:
            onlooker.see(Seen(event, duration_ms, self._frame, sighting))


STAGE_OF: dict[type[Event], str] = {
    FrameAdded: "add_frame",
    DepthMapMade: "depth_map",
    FieldAdded: "distance_field",
    VolumeFused: "fusion",
    SurfaceCast: "ray_cast",
    HeightMapsMade: "height_map",
    CostMapComputed: "cost_map",
    BeliefUpdated: "particles",
    Aligned: "icp",
    MapAugmented: "augmentation",
    GroundMapExtended: "ground_map",
}
"""Names of the timed stages. An oracle's tracking costs nothing worth reporting."""


def timed(events: Iterable[Event]) -> Iterator[tuple[Event, float]]:
    """Each event with the time that it took to come [ms]."""
    iterator = iter(events)
    while True:
        start = time.perf_counter()
        event = next(iterator, None)
        if event is None:
            return
        yield event, (time.perf_counter() - start) * 1e3

"""Events of a run as consumers see them: timed from outside, with their circumstances.

Every stage yields one event when it is done, so the time between asking for the next event and
getting it is the duration of that stage.
"""

from __future__ import annotations

import time
from collections.abc import Iterable, Iterator
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
from airground.core.sighting import Sighting
from airground.tracking import TrackedFrame

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
"""Name of the timed stage that ends with each event."""


@dataclass(frozen=True, eq=False)
class Seen:
    """One event with its circumstances.

    Attributes:
        event: The event.
        duration_ms: Time that the event took [ms]; for events of tracking, the wait for it.
        frame: The newest tracked image.
        sighting: The newest aerial surface with both maps at its time; None before the first,
            and where a robot was lost when the newest surface was cast.
    """

    event: Event
    duration_ms: float
    frame: TrackedFrame
    sighting: Sighting | None


class Onlooker(Protocol):
    """A consumer of a run's events. It changes nothing in the run."""

    def see(self, seen: Seen) -> None:
        """Consume one event; called in order of the events, while no stage runs."""


def timed(events: Iterable[Event]) -> Iterator[tuple[Event, float]]:
    """Each event with its duration [ms]."""
    iterator = iter(events)
    while True:
        start = time.perf_counter()
        event = next(iterator, None)
        if event is None:
            return
        yield event, (time.perf_counter() - start) * 1e3

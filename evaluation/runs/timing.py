"""Times the pipeline's stages from outside: no stage holds a clock.

Every stage yields one event when it is done, so the time between asking for the next event
and getting it is what that stage took.
"""

from __future__ import annotations

import time
from collections.abc import Iterable, Iterator

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

"""What happened, in words: lost, found, converged, refused."""

from __future__ import annotations

import rerun as rr

from airground.core.cloud import Source
from airground.core.events import (
    Aligned,
    BeliefUpdated,
    Event,
    GroundTracked,
    Initializing,
    MapAugmented,
    MavTracked,
    PosesCorrected,
    TrackingLost,
)
from evaluation.run.onlooker import Seen
from evaluation.show.rerun_view.sensor_stream import SensorStream

ENTITY = "events"
GOOD, NOTE, BAD = rr.TextLogLevel.INFO, rr.TextLogLevel.DEBUG, rr.TextLogLevel.WARN
Said = tuple[str, rr.TextLogLevel]
WHO = {Source.MAV: "MAV", Source.GROUND: "ground robot"}


class Messages:
    """A log of what a person would want to hear of.

    Args:
        stream: To write to.
    """

    def __init__(self, stream: SensorStream) -> None:
        self._stream = stream
        self._state: dict[Source, type[Event]] = {}

    def see(self, seen: Seen) -> None:
        """Say it, if there is something to say."""
        said = self._tracking(seen) or _mapping(seen.event)
        if said is not None:
            text, level = said
            self._stream.log(seen.event.stamp_ns, ENTITY, rr.TextLog(text, level=level))

    def _tracking(self, seen: Seen) -> Said | None:
        """How a robot gets on, where that changed."""
        kind, robot = type(seen.event), seen.frame.robot
        if kind not in (MavTracked, GroundTracked, Initializing, TrackingLost):
            return None
        before = self._state.get(robot)
        self._state[robot] = kind
        if kind is before:
            return None
        if kind is Initializing:
            return f"{WHO[robot]}: has no map yet", NOTE
        if kind is TrackingLost:
            return f"{WHO[robot]}: lost", BAD
        again = "found again" if before is TrackingLost else "tracked"
        return f"{WHO[robot]}: {again}", GOOD


def _mapping(event: Event) -> Said | None:
    match event:
        case PosesCorrected(robot=robot):
            return f"{WHO[robot]}: map corrected, earlier poses moved", NOTE
        case BeliefUpdated(belief=belief) if belief.converged:
            return f"particles: converged, spread {belief.spread_m:.2f} m", GOOD
        case BeliefUpdated(belief=belief):
            return f"particles: refused, {belief.refusal}", BAD
        case Aligned(alignment=alignment) if alignment.accepted:
            fit = f"{alignment.inliers:.0%} inliers, {1e3 * alignment.rmse_m:.0f} mm"
            return f"alignment: accepted, {fit}", GOOD
        case Aligned(alignment=alignment):
            return f"alignment: refused, {alignment.refusal}", BAD
        case MapAugmented(cloud_ground=cloud):
            return f"map: {len(cloud)} aerial points added", NOTE
    return None

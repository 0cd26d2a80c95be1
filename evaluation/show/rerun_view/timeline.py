"""Curves over time (errors, spread, tracking quality, stage times), and messages in words."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
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
    NotLocated,
    PosesCorrected,
    TrackingLost,
)
from airground.core.se3 import SE3
from evaluation.run.onlooker import STAGE_OF, Seen
from evaluation.show.figures.style import SERIES
from evaluation.show.rerun_view.sensor_stream import ROBOT, TRUTH, Level, Pace, SensorStream, rgb
from evaluation.table.truth_errors import BothPoses, pose_error
from sim.recording.truth import Truth

ROOM, ERRORS, MESSAGES = "curves", f"{TRUTH}/error", "events"
TRACKED_STAGE: dict[type, str] = {MavTracked: "track_mav", GroundTracked: "track_ground"}
"""Tracking of one image, decoding included."""
COLOURS = tuple(
    rgb(colour)
    for colour in (*SERIES, "#56B4E9", "#F0E442", "#D55E00", "#999999", "#8DD3C7", "#BC80BD",
                   "#FB8072")
)  # fmt: skip
"""As many as the plot of stage times has curves."""


@dataclass(frozen=True)
class LivePoses:
    """The newest poses of both cameras, as in a `Sighting`."""

    mav_stamp_ns: int
    T_mav_camera: SE3
    ground_stamp_ns: int
    T_ground_camera: SE3


class Curves:
    """Curves of a run; with truth also errors.
    Errors are those of the belief ("particles"), of the alignment ("refined"), and of the newest
    poses under the newest accepted alignment ("live")."""

    def __init__(self, stream: SensorStream, level: Level, truth: Truth | None) -> None:
        self._stream, self._truth = stream, truth
        self._pace = {robot: Pace(level.pose_hz) for robot in Source}
        self._poses: dict[Source, tuple[int, SE3]] = {}
        self._T_ground_mav: SE3 | None = None
        self._styled: set[str] = set()

    def see(self, seen: Seen) -> None:
        stamp_ns = seen.event.stamp_ns
        match seen.event:
            case (
                MavTracked(T_mav_camera=T_map_camera) | GroundTracked(T_ground_camera=T_map_camera)
            ):
                self._poses[seen.frame.robot] = stamp_ns, T_map_camera
                if self._pace[seen.frame.robot].due(stamp_ns):
                    self._draw_tracking(seen, stamp_ns)
            case BeliefUpdated(belief=belief):
                self._draw(stamp_ns, f"{ROOM}/spread_m", belief.spread_m)
                self._draw_error(stamp_ns, "particles", belief.T_ground_mav, seen.sighting)
            case Aligned(alignment=alignment):
                self._draw_error(stamp_ns, "refined", alignment.T_ground_mav, seen.sighting)
                if alignment.accepted:
                    self._T_ground_mav = alignment.T_ground_mav
        if type(seen.event) in STAGE_OF:
            stage = STAGE_OF[type(seen.event)]
            self._draw(stamp_ns, f"{ROOM}/stage_ms/{stage}", seen.duration_ms)

    def _draw_tracking(self, seen: Seen, stamp_ns: int) -> None:
        robot, pose = ROBOT[seen.frame.robot], seen.frame.pose
        stage = TRACKED_STAGE[type(seen.event)]
        self._draw(stamp_ns, f"{ROOM}/stage_ms/{stage}", seen.duration_ms)
        if pose.corners is not None:
            self._draw(stamp_ns, f"{ROOM}/corners/{robot}", int(pose.corners.mapped.sum()))
        if pose.covariance is not None:
            sigma_m = float(np.sqrt(np.trace(pose.covariance[:3, :3])))
            self._draw(stamp_ns, f"{ROOM}/sigma_mm/{robot}", 1e3 * sigma_m)
        known = len(self._poses) == len(Source)
        if seen.frame.robot == Source.MAV and self._T_ground_mav is not None and known:
            poses = LivePoses(*self._poses[Source.MAV], *self._poses[Source.GROUND])
            self._draw_error(stamp_ns, "live", self._T_ground_mav, poses)

    def _draw_error(
        self, stamp_ns: int, name: str, T_ground_mav: SE3, poses: BothPoses | None
    ) -> None:
        if self._truth is None or poses is None:
            return
        error = pose_error(T_ground_mav, poses, self._truth)
        self._draw(stamp_ns, f"{ERRORS}/translation_m/{name}", error.translation_m)
        self._draw(stamp_ns, f"{ERRORS}/rotation_deg/{name}", error.rotation_deg)

    def _draw(self, stamp_ns: int, entity: str, value: float) -> None:
        if entity not in self._styled:
            # A new curve gets its name and the next colour of its plot.
            plot, name = entity.rsplit("/", 1)
            before = sum(other.startswith(f"{plot}/") for other in self._styled)
            look = rr.SeriesLines(
                colors=[COLOURS[before % len(COLOURS)]], names=[name], widths=[1.5]
            )
            self._styled.add(entity)
            self._stream.log_always(entity, look)
        self._stream.log(stamp_ns, entity, rr.Scalars([value]))


GOOD, NOTE, BAD = rr.TextLogLevel.INFO, rr.TextLogLevel.DEBUG, rr.TextLogLevel.WARN
DECISIONS = (GOOD, BAD, rr.TextLogLevel.ERROR)
"""Levels that the list shows; corrected maps and added points are notes."""
Message = tuple[str, rr.TextLogLevel]
NAMES = {Source.MAV: "MAV", Source.GROUND: "ground robot"}


class Messages:
    """A log of changes in tracking, and of the outcome of each stage above it."""

    def __init__(self, stream: SensorStream) -> None:
        self._stream = stream
        self._state: dict[Source, type[Event]] = {}

    def see(self, seen: Seen) -> None:
        message = self._tracking(seen) or _mapping(seen.event)
        if message is not None:
            text, level = message
            self._stream.log(seen.event.stamp_ns, MESSAGES, rr.TextLog(text, level=level))

    def _tracking(self, seen: Seen) -> Message | None:
        kind, robot = type(seen.event), seen.frame.robot
        before = self._state.get(robot)
        if kind not in (MavTracked, GroundTracked, Initializing, TrackingLost) or kind is before:
            return None
        self._state[robot] = kind
        if kind is Initializing:
            return f"{NAMES[robot]}: has no map yet", NOTE
        if kind is TrackingLost:
            return f"{NAMES[robot]}: lost", BAD
        again = "found again" if before is TrackingLost else "tracked"
        return f"{NAMES[robot]}: {again}", GOOD


def _mapping(event: Event) -> Message | None:
    match event:
        case PosesCorrected(robot=robot):
            return f"{NAMES[robot]}: map corrected, earlier poses moved", NOTE
        case NotLocated(reason=reason):
            return f"surface: not located, {reason}", BAD
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

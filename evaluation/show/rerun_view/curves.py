"""Numbers over time: errors, spread, tracking quality, stage times."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import rerun as rr

from airground.core.cloud import Source
from airground.core.events import Aligned, BeliefUpdated, GroundTracked, MavTracked
from airground.core.se3 import SE3
from evaluation.run.onlooker import STAGE_OF, Seen
from evaluation.show.figures.style import SERIES
from evaluation.show.rerun_view.depth_maps import rgb
from evaluation.show.rerun_view.sensor_stream import ROBOT, TRUTH, Level, Pace, SensorStream
from evaluation.table.truth_errors import BothPoses, pose_error
from sim.recording.truth import Truth

ROOM = "curves"
ERRORS = f"{TRUTH}/error"
TRACKED_STAGE: dict[type, str] = {MavTracked: "track_mav", GroundTracked: "track_ground"}
"""An image tracked, decoding included."""
STEPS = ("particles", "refined", "live")
"""What has an error: the belief, the alignment, and the alignment with the newest poses."""
COLOURS = tuple(
    rgb(colour)
    for colour in (
        *SERIES,
        "#56B4E9",
        "#F0E442",
        "#D55E00",
        "#999999",
        "#8DD3C7",
        "#BC80BD",
        "#FB8072",
    )
)


@dataclass(frozen=True)
class LivePoses:
    """The newest poses of both cameras, as in a `Sighting`."""

    mav_stamp_ns: int
    T_mav_camera: SE3
    ground_stamp_ns: int
    T_ground_camera: SE3


class Curves:
    """Curves of a run.

    Args:
        stream: To draw on.
        level: How often.
        truth: Where given, there are errors too.
    """

    def __init__(self, stream: SensorStream, level: Level, truth: Truth | None) -> None:
        self._stream, self._truth = stream, truth
        self._pace = {robot: Pace(level.pose_hz) for robot in Source}
        self._poses: dict[Source, tuple[int, SE3]] = {}
        self._T_ground_mav: SE3 | None = None
        self._styled: set[str] = set()

    def see(self, seen: Seen) -> None:
        """Go on with the curves that the event tells something of."""
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
            used = int(pose.corners.mapped.sum())
            self._draw(stamp_ns, f"{ROOM}/corners/{robot}", used)
        if pose.covariance is not None:
            sigma_m = float(np.sqrt(np.trace(pose.covariance[:3, :3])))
            self._draw(stamp_ns, f"{ROOM}/sigma_mm/{robot}", 1e3 * sigma_m)
        if seen.frame.robot == Source.MAV and self._T_ground_mav is not None:
            self._draw_error(stamp_ns, "live", self._T_ground_mav, self._live_poses())

    def _live_poses(self) -> LivePoses | None:
        if len(self._poses) < len(Source):
            return None
        return LivePoses(*self._poses[Source.MAV], *self._poses[Source.GROUND])

    def _draw_error(
        self, stamp_ns: int, what: str, T_ground_mav: SE3, poses: BothPoses | None
    ) -> None:
        if self._truth is None or poses is None:
            return
        error = pose_error(T_ground_mav, poses, self._truth)
        self._draw(stamp_ns, f"{ERRORS}/translation_m/{what}", error.translation_m)
        self._draw(stamp_ns, f"{ERRORS}/rotation_deg/{what}", error.rotation_deg)

    def _draw(self, stamp_ns: int, entity: str, value: float) -> None:
        if entity not in self._styled:
            self._style(entity)
        self._stream.log(stamp_ns, entity, rr.Scalars([value]))

    def _style(self, entity: str) -> None:
        """A curve gets its name and the next colour of its plot; rare points get marks."""
        plot, name = entity.rsplit("/", 1)
        colour = COLOURS[sum(other.startswith(f"{plot}/") for other in self._styled) % len(COLOURS)]
        self._styled.add(entity)
        self._stream.log_always(entity, rr.SeriesLines(colors=[colour], names=[name], widths=[1.5]))

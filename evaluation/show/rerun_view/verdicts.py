"""Why a run failed here: thresholds beside the curves, and marks where something was refused, lost
or claimed wrongly. A click on a mark moves every panel to that moment."""

from __future__ import annotations

import rerun as rr

from airground.config import Config
from airground.core.belief import Alignment, Belief
from airground.core.events import Aligned, BeliefUpdated, TrackingLost
from evaluation.run.onlooker import Seen
from evaluation.show.rerun_view.sensor_stream import ROBOT, SensorStream
from evaluation.show.rerun_view.timeline import ERRORS, ROOM
from evaluation.table.limits import LOCATED_M, is_good_pose
from evaluation.table.truth_errors import pose_error
from sim.recording.truth import Truth

SPREAD, OVERLAP, INLIERS, CORNERS = (
    f"{ROOM}/{curve}" for curve in ("spread_m", "overlap", "inliers", "corners")
)
REFUSED, LOST, WRONG = "refused", "lost", "wrong_claim"
LIMIT_GREY, RED, GREEN = (150, 150, 150), (255, 70, 70), (53, 196, 106)


class Verdicts:
    """Thresholds and marks of a run; with truth also claims that are wrong."""

    def __init__(self, stream: SensorStream, config: Config, truth: Truth | None) -> None:
        self._stream, self._truth = stream, truth
        self._spread_limit_m = config.localization.converged_spread_m
        self._least_overlap = config.localization.min_overlap
        self._least_inliers = config.refinement.min_inliers
        for limit, name in ((SPREAD, "largest"), (OVERLAP, "least"), (INLIERS, "least")):
            stream.log_always(
                f"{limit}/limit",
                rr.SeriesLines(colors=[LIMIT_GREY], names=[name], widths=[1.0]),
            )
        for curve, name in ((OVERLAP, "overlap"), (INLIERS, "inliers")):
            stream.log_always(curve, rr.SeriesLines(colors=[GREEN], names=[name], widths=[1.5]))
        marked = [f"{curve}/{REFUSED}" for curve in (SPREAD, OVERLAP, INLIERS)]
        marked += [_lost(robot) for robot in ROBOT.values()]
        marked += [] if truth is None else [_wrong("translation_m"), _wrong("rotation_deg")]
        for entity in marked:
            stream.log_always(entity, _mark(entity))

    def see(self, seen: Seen) -> None:
        stamp_ns = seen.event.stamp_ns
        match seen.event:
            case BeliefUpdated(belief=belief):
                self._draw(stamp_ns, f"{SPREAD}/limit", self._spread_limit_m)
                self._draw(stamp_ns, OVERLAP, belief.overlap)
                self._draw(stamp_ns, f"{OVERLAP}/limit", self._least_overlap)
                if belief.refusal:
                    self._draw(stamp_ns, f"{SPREAD}/{REFUSED}", belief.spread_m)
                if not belief.overlap > self._least_overlap:
                    self._draw(stamp_ns, f"{OVERLAP}/{REFUSED}", belief.overlap)
                self._mark_wrong(seen, belief)
            case Aligned(alignment=alignment):
                self._draw(stamp_ns, INLIERS, alignment.inliers)
                self._draw(stamp_ns, f"{INLIERS}/limit", self._least_inliers)
                if alignment.refusal:
                    self._draw(stamp_ns, f"{INLIERS}/{REFUSED}", alignment.inliers)
                self._mark_wrong(seen, alignment)
            case TrackingLost(robot=robot):
                self._draw(stamp_ns, _lost(ROBOT[robot]), 0.0)

    def _mark_wrong(self, seen: Seen, claim: Belief | Alignment) -> None:
        """Mark the error of a claim that is none of a good pose."""
        if self._truth is None or seen.sighting is None or claim.refusal:
            return
        error = pose_error(claim.T_ground_mav, seen.sighting, self._truth)
        if isinstance(claim, Belief):
            right = error.horizontal_m <= LOCATED_M
        else:
            right = bool(is_good_pose(error.translation_m, error.rotation_deg))
        if not right:
            self._draw(seen.event.stamp_ns, _wrong("translation_m"), error.translation_m)
            self._draw(seen.event.stamp_ns, _wrong("rotation_deg"), error.rotation_deg)

    def _draw(self, stamp_ns: int, entity: str, value: float) -> None:
        self._stream.log(stamp_ns, entity, rr.Scalars([value]))


def _lost(robot: str) -> str:
    return f"{CORNERS}/{robot}/{LOST}"


def _wrong(error: str) -> str:
    return f"{ERRORS}/{error}/{WRONG}"


def _mark(entity: str) -> rr.SeriesPoints:
    name = entity.rsplit("/", 1)[1].replace("_", " ")
    return rr.SeriesPoints(colors=[RED], markers="cross", names=[name], marker_sizes=[4])

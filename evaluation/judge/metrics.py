"""The watched metrics: a literal table. Times are never judged: they depend on the machine.

What matters is declared before anything is measured, as a share of the accepted figure for
errors, and in percentage points for shares. A smaller effect is no difference, however sure.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

from evaluation.judge import samples
from evaluation.judge.samples import Samples, Take
from evaluation.measure.protocol import wide_search
from evaluation.table.rows import ResultTable

UnitOfObservation = Literal["recording", "surface", "sequence", "aerial map", "trial"]


@dataclass(frozen=True)
class Metric:
    """One watched metric.

    Attributes:
        name: Its key in files.
        title: What a reader sees.
        unit: "m", "deg", "count", "cost" (a height map's), or "" for a share.
        better: Which direction is.
        each: What one value belongs to.
        take: Finds the values in a table of results.
        failure: What a missing or failed value counts as.
        share: Whether values are 0 or 1, told as a share.
        matters: The smallest effect that does; of the accepted figure where `relative`.
        relative: See `matters`.
        why: Why that much matters and no less.
        controls: Whether it is of scenes in which there is nothing to find.
    """

    name: str
    title: str
    unit: str
    better: Literal["lower", "higher"]
    each: UnitOfObservation
    take: Take
    failure: float
    matters: float
    why: str
    share: bool = False
    relative: bool = False
    controls: bool = False

    def samples(self, table: ResultTable) -> Samples:
        """Its values in a table of one condition, by flight."""
        part = table.controls() if self.controls else table.without_controls()
        return samples.by_flight(part, self.take(part), self.failure)


def _error(name: str, title: str, each: UnitOfObservation, take: Take, unit: str = "m") -> Metric:
    """An error in metres or degrees: failures are infinitely large."""
    slam = each == "recording"
    return Metric(
        name,
        title,
        unit,
        "lower",
        each,
        take,
        failure=math.inf,
        matters=0.10 if slam else 0.05,
        why="a tenth: one path's error says no more" if slam else "a twentieth: less helps nobody",
        relative=True,
    )


def _success(name: str, title: str, each: UnitOfObservation, take: Take) -> Metric:
    """How often something succeeds: what is missing did not."""
    why = "two in a hundred: the goals are told in so many"
    return Metric(name, title, "", "higher", each, take, 0.0, 0.02, why, share=True)


def _wrong(
    name: str, title: str, each: UnitOfObservation, take: Take, controls: bool = False
) -> Metric:
    """How often something false is claimed: what is missing claims nothing."""
    why = "one in a hundred: the goal is to stay below it"
    return Metric(
        name, title, "", "lower", each, take, 0.0, 0.01, why, share=True, controls=controls
    )


WATCHED = (
    _error(
        "mav_trajectory",
        "MAV's SLAM, live",
        "recording",
        samples.values("trajectory", "mav_ate_se3_rmse_m"),
    ),
    _error(
        "ground_trajectory",
        "ground robot's SLAM, live",
        "recording",
        samples.values("trajectory", "ground_ate_se3_rmse_m"),
    ),
    Metric(
        "mav_tracked",
        "MAV tracked",
        "",
        "higher",
        "recording",
        samples.values("trajectory", "mav_tracked_fraction"),
        failure=0.0,
        matters=0.02,
        why="two in a hundred: half a second of these flights",
    ),
    Metric(
        "ground_tracked",
        "ground robot tracked",
        "",
        "higher",
        "recording",
        samples.values("trajectory", "ground_tracked_fraction"),
        failure=0.0,
        matters=0.02,
        why="two in a hundred: half a second of these drives",
    ),
    Metric(
        "aerial_maps",
        "aerial maps a flight",
        "count",
        "higher",
        "recording",
        samples.surfaces_a_flight,
        failure=0.0,
        matters=0.05,
        why="a twentieth: less than one map a flight",
        relative=True,
    ),
    _error(
        "surface_median",
        "surface, median error",
        "surface",
        samples.values("surface", "error_median_m"),
    ),
    _error(
        "surface_p90",
        "surface, 90 % error",
        "surface",
        samples.values("surface", "error_p90_m"),
    ),
    Metric(
        "completeness",
        "surface, completeness",
        "",
        "higher",
        "surface",
        samples.values("surface", "completeness"),
        failure=0.0,
        matters=0.02,
        why="two in a hundred pixels: what one depth map more or less gives",
    ),
    _error(
        "localization_1",
        "localization error, map 1",
        "sequence",
        samples.localization("error_m", 1),
    ),
    _error(
        "localization_4",
        "localization error, map 4",
        "sequence",
        samples.localization("error_m", 4),
    ),
    # How much the first map leaves open (Fig. 12).
    _error(
        "spread_1",
        "particles' spread, map 1",
        "sequence",
        samples.localization("spread_m", 1),
    ),
    # How clearly the true place wins where most places hold little of the map.
    Metric(
        "wide_lead",
        "true place's lead, wide",
        "cost",
        "higher",
        "surface",
        samples.values(wide_search.STAGE, "lead"),
        failure=-wide_search.WORST,
        matters=0.05,
        why="a twentieth: less helps nobody",
        relative=True,
    ),
    _success(
        "wide_within_50cm",
        "within 0.5 m, wide search",
        "surface",
        samples.widely_located(0.50),
    ),
    _success("within_50cm_1", "within 0.5 m, map 1", "sequence", samples.located(1, 0.50)),
    _success("within_25cm_4", "within 0.25 m, map 4", "sequence", samples.located(4, 0.25)),
    _success("located", "localizations accepted", "aerial map", samples.claimed),
    _wrong(
        "located_wrongly",
        "accepted, beyond 0.25 m",
        "aerial map",
        samples.claimed_wrongly,
    ),
    _error(
        "refined_translation",
        "refined position",
        "trial",
        samples.refined("after_translation_m"),
    ),
    _error(
        "refined_rotation",
        "refined angle",
        "trial",
        samples.refined("after_rotation_deg"),
        unit="deg",
    ),
    _success("refined_well", "refined within 5 cm, 2°", "trial", samples.refined_well),
    _success("refinement_accepted", "refinements accepted", "trial", samples.refined("accepted")),
    _wrong(
        "refined_wrongly",
        "accepted, beyond 5 cm, 2°",
        "trial",
        samples.refined_wrongly,
    ),
    _wrong(
        "control_claims",
        "claims in control scenes",
        "aerial map",
        samples.claimed,
        controls=True,
    ),
)

"""The table of metrics: what is measured, in which direction it is better, and what matters.

Summary, report, verdicts, sweeps and the documentation read it. Times are never judged, since
they depend on the machine. What matters is declared before anything is measured, as a share of
the accepted figure for errors and in percentage points for shares; a smaller effect makes no
verdict, however certain it is.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

from evaluation.judge import samples
from evaluation.judge.samples import Samples, Take
from evaluation.measure.protocol import wide_search
from evaluation.setup import published
from evaluation.setup.published import Published
from evaluation.setup.text import MISSING, degrees, formatted, metres, percent
from evaluation.table.limits import (
    FIRST_MAP,
    FOURTH_MAP,
    GOOD_POSE,
    LOCATED_M,
    NEAR_M,
    REFINED_DEG,
    REFINED_M,
)
from evaluation.table.rows import ALIGNMENT_STAGE, ResultTable

UnitOfObservation = Literal["recording", "surface", "sequence", "aerial map", "trial"]


@dataclass(frozen=True)
class Metric:
    """One metric.

    Attributes:
        name: Its key in files.
        title: Its name for readers.
        unit: "m", "deg", "count", "cost" (of height maps), or "" for a share.
        better: Which direction is better.
        each: What one value belongs to.
        take: Finds the values in a table of results.
        failure: What a missing or failed value counts as.
        why: Reason of `matters`.
        matters: The smallest effect that matters; 0 for a metric that is shown, not judged.
        relative: Whether `matters` is a share of the accepted figure, else it has the unit.
        share: Whether values are 0 or 1, summarized by their mean.
        controls: Whether it is of scenes in which there is nothing to find.
        iteration: Aerial map after which a sequence is judged; None for other metrics.
        published: The paper's value.
    """

    name: str
    title: str
    unit: str
    better: Literal["lower", "higher"]
    each: UnitOfObservation
    take: Take
    failure: float
    why: str = ""
    matters: float = 0.0
    relative: bool = False
    share: bool = False
    controls: bool = False
    iteration: int | None = None
    published: Published | None = None

    def samples(self, table: ResultTable) -> Samples:
        """Its values in a table of one condition, by flight."""
        part = table.controls() if self.controls else table.scored()
        return samples.by_flight(part, self.take(part), self.failure)

    def text(self, value: float) -> str:
        """A value for readers."""
        match self.unit:
            case "m":
                return metres(value)
            case "deg":
                return degrees(value)
            case _:
                return self.fine_text(value)

    def fine_text(self, value: float, sign: str = "") -> str:
        """A value to compare with another, with one more digit; `sign` "+" for a change."""
        match self.unit:
            case "m":
                return metres(value, 2, sign)
            case "deg":
                return degrees(value, 3, sign)
            case "count":
                return formatted(value, f"{{:{sign}.1f}}")
            case "cost":
                return formatted(value, f"{{:{sign}.3f}}")
            case _:
                return percent(value, 1, sign)

    @property
    def paper(self) -> str:
        """The paper's value for readers."""
        if self.published is None:
            return MISSING
        value = self.published.value
        forms = {"m": f"{1e3 * value:g} mm", "deg": f"{value:.1f}°", "": f"{100 * value:g} %"}
        return forms[self.unit]


_TENTH = "a tenth: the error of one path varies by less"
_TWENTIETH = "a twentieth: smaller changes do not matter in practice"
_TWO = "two in a hundred: the goals are stated to that precision"
_ONE = "one in a hundred: the goal is to stay below it"


def _error(
    name: str,
    title: str,
    each: UnitOfObservation,
    take: Take,
    unit: str = "m",
    iteration: int | None = None,
    published: Published | None = None,
) -> Metric:
    """An error in metres or degrees: a failure is infinitely large."""
    why, matters = (_TENTH, 0.10) if each == "recording" else (_TWENTIETH, 0.05)
    return Metric(
        name, title, unit, "lower", each, take, math.inf, why, matters, relative=True,
        iteration=iteration, published=published,
    )  # fmt: skip


def _success(
    name: str,
    title: str,
    each: UnitOfObservation,
    take: Take,
    iteration: int | None = None,
    published: Published | None = None,
) -> Metric:
    """How often something succeeds: what is missing did not."""
    return Metric(
        name, title, "", "higher", each, take, 0.0, _TWO, 0.02, share=True,
        iteration=iteration, published=published,
    )  # fmt: skip


def _wrong(
    name: str, title: str, each: UnitOfObservation, take: Take, controls: bool = False
) -> Metric:
    """How often something false is claimed: what is missing claims nothing."""
    return Metric(
        name, title, "", "lower", each, take, 0.0, _ONE, 0.01, share=True, controls=controls
    )


def _tracked(robot: str, title: str) -> Metric:
    """The share of tracked images; `evaluation.table.tracked_share` defines it."""
    take = samples.values("trajectory", f"{robot}_tracked_fraction")
    why = "two in a hundred: half a second of a recording of the suite"
    return Metric(f"{robot}_tracked", title, "", "higher", "recording", take, 0.0, why, 0.02)


WATCHED = (
    _error(
        "mav_trajectory", "MAV: live, RMS error", "recording",
        samples.values("trajectory", "mav_ate_se3_rmse_m"), published=published.MAV_RMSE_M,
    ),
    _error(
        "ground_trajectory", "ground: live, RMS error", "recording",
        samples.values("trajectory", "ground_ate_se3_rmse_m"), published=published.GROUND_RMSE_M,
    ),
    _tracked("mav", "MAV: tracked"),
    _tracked("ground", "ground: tracked"),
    Metric(
        "aerial_maps", "aerial maps per flight", "count", "higher", "recording",
        samples.surfaces_a_flight, 0.0, "a twentieth: less than one map per flight", 0.05,
        relative=True,
    ),
    _error(
        "surface_median", "surface, median error", "surface",
        samples.values("surface", "error_median_m"),
    ),
    _error(
        "surface_p90", "surface, 90 % error", "surface", samples.values("surface", "error_p90_m")
    ),
    Metric(
        "completeness", "surface, completeness", "", "higher", "surface",
        samples.values("surface", "completeness"), 0.0,
        "two in a hundred pixels: the effect of one depth map more or less", 0.02,
    ),
    _error(
        "localization_1", "localization error, map 1", "sequence",
        samples.localization("error_m", FIRST_MAP), iteration=FIRST_MAP,
    ),
    _error(
        "localization_4", "localization error, map 4", "sequence",
        samples.localization("error_m", FOURTH_MAP), iteration=FOURTH_MAP,
    ),
    # How much the first map leaves open (Fig. 12).
    _error(
        "spread_1", "particles' spread, map 1", "sequence",
        samples.localization("spread_m", FIRST_MAP), iteration=FIRST_MAP,
    ),
    # How clearly the true place wins where most places hold little of the map.
    Metric(
        "wide_lead", "true place's lead, wide", "cost", "higher", "surface",
        samples.values(wide_search.STAGE, "lead"), -max(wide_search.WORST.values()), _TWENTIETH,
        0.05, relative=True,
    ),
    _success(
        "wide_within_50cm", f"within {NEAR_M:g} m, wide search", "surface",
        samples.widely_located(NEAR_M),
    ),
    _success(
        "within_50cm_1", f"within {NEAR_M:g} m after 1 map", "sequence",
        samples.located(FIRST_MAP, NEAR_M), FIRST_MAP, published.WITHIN_0_50_M_FIRST,
    ),
    _success(
        "within_25cm_4", f"within {LOCATED_M:g} m after 4 maps", "sequence",
        samples.located(FOURTH_MAP, LOCATED_M), FOURTH_MAP, published.WITHIN_0_25_M_FOURTH,
    ),
    _success("located", "positions claimed", "aerial map", samples.claimed),
    _wrong(
        "located_wrongly", f"claimed, beyond {LOCATED_M:g} m", "aerial map",
        samples.claimed_wrongly,
    ),
    _error(
        "refined_translation", "refined position", "trial", samples.refined("after_translation_m"),
        published=published.REFINEMENT_TRANSLATION_M,
    ),
    _error(
        "refined_rotation", "refined angle", "trial", samples.refined("after_rotation_deg"),
        unit="deg", published=published.REFINEMENT_ROTATION_DEG,
    ),
    _success("refined_well", f"refined within {GOOD_POSE}", "trial", samples.refined_well),
    _success("refinement_accepted", "refinements accepted", "trial", samples.refined("accepted")),
    _wrong(
        "refined_wrongly", f"accepted, beyond {100 * REFINED_M:g} cm, {REFINED_DEG:g}°", "trial",
        samples.refined_wrongly,
    ),
    _wrong(
        "control_claims", "claims in control scenes", "aerial map", samples.claimed, controls=True
    ),
)  # fmt: skip
"""Metrics that verdicts judge, in the order in which files and tables have them."""

HEADING_DEG = 3.0
"""Limit of the heading's error beside that of the position: the paper's median [deg]."""
SHOWN = (
    Metric(
        "posed_4", f"within {LOCATED_M:g} m and {HEADING_DEG:g}° after 4 maps", "", "higher",
        "sequence", samples.located(FOURTH_MAP, LOCATED_M, HEADING_DEG), 0.0, share=True,
        iteration=FOURTH_MAP,
    ),
    Metric(
        "localization_12", "localization error, map 12", "m", "lower", "sequence",
        samples.localization("error_m", 12), math.inf, iteration=12,
    ),
    Metric(
        "aligned_well", f"pipeline's own alignments within {GOOD_POSE}", "", "higher",
        "aerial map", samples.aligned_well, 0.0, share=True,
    ),
    Metric(
        "aligned_translation", "pipeline's own alignments, position", "m", "lower", "aerial map",
        samples.values(ALIGNMENT_STAGE, "after_translation_m"), math.inf,
    ),
)  # fmt: skip
"""Metrics that reports show and verdicts do not judge."""

METRICS = {metric.name: metric for metric in (*WATCHED, *SHOWN)}

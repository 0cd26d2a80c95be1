"""All figures of the report, each with a caption that states its conditions."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from evaluation.judge.metrics import METRICS
from evaluation.measure.showcase import Showcase
from evaluation.setup import published
from evaluation.setup.condition import Condition, shared_parts, short_labels
from evaluation.show.figures.fig11_12_localization_error import (
    localization_error_figure,
    spread_figure,
)
from evaluation.show.figures.fig13_14_refinement_error import (
    BeforeAfter,
    refinement_angle_figure,
    refinement_translation_figure,
)
from evaluation.show.figures.showcase_figures import showcase_figures
from evaluation.show.figures.style import SERIES, ReportFigure
from evaluation.show.figures.table1_timing import timing_figure
from evaluation.show.report.appearance import appearance_figures
from evaluation.show.report.calibration import calibration_figures
from evaluation.show.report.error_budget import budget_figure
from evaluation.show.report.trajectories import trajectory_figures
from evaluation.table.limits import LOCATED_M, NEAR_M
from evaluation.table.rows import ResultTable

PAPER = (
    f"{METRICS['within_50cm_1'].paper} {METRICS['within_50cm_1'].title}, "
    f"{METRICS['within_25cm_4'].paper} {METRICS['within_25cm_4'].title}, "
    f"{published.SEQUENCES.value:g} sequences"
)
COMPARED = len(SERIES)
"""Conditions drawn side by side; more would have no colour of their own."""


@dataclass(frozen=True)
class Drawn:
    """One condition, or one run of it, as figures show it."""

    condition: Condition
    table: ResultTable
    label: str
    colour: str


def report_figures(
    table: ResultTable, conditions: Sequence[Condition], showcase: Showcase | None
) -> Iterator[ReportFigure]:
    """Draw the figures for which there is data, in the paper's order."""
    if showcase is not None:
        yield from showcase_figures(showcase)
    drawn = _chosen(table, conditions)
    # With the scenes that are in no other number: Fig. 3 is about the outdoor one.
    yield from appearance_figures(table.of(conditions[0]), conditions[0])
    if conditions[0].poses != "oracle exact":
        yield from trajectory_figures(table, [d.condition for d in drawn])
    yield from localization_figures(drawn)
    yield from calibration_figures(drawn[0].table, conditions[0])
    yield from refinement_figures(_distinct(drawn))
    yield from budget_figure(drawn[0].table, conditions[0])
    yield from _timing(drawn[0])


def _chosen(table: ResultTable, conditions: Sequence[Condition]) -> list[Drawn]:
    """The primary condition, those of the other preset, then the rest: four at most."""
    primary = conditions[0]
    ordered = sorted(conditions[1:], key=lambda c: c.preset == primary.preset)
    chosen = [primary, *ordered][:COMPARED]
    labels = short_labels(chosen)
    return [
        Drawn(c, table.of(c).scored(), label, colour)
        for c, label, colour in zip(chosen, labels, SERIES, strict=False)
    ]


def localization_figures(drawn: list[Drawn]) -> Iterator[ReportFigure]:
    """Fig. 11 and 12, side by side."""
    shown = [d for d in drawn if len(d.table.sequences("error_m"))]
    if not shown:
        return
    counts = _counts(shown, [len(d.table.sequences("error_m")) for d in shown], "sequences")
    colours = [d.colour for d in shown]
    yield ReportFigure(
        "fig11_localization_error",
        "Fig. 11: localization error over the iterations",
        "Horizontal distance between the estimated and the true position of the MAV relative to "
        "the ground robot, no alignment applied. Boxes: median and quartiles; whiskers to 1.5 "
        "interquartile ranges; every outlier is drawn; a number with a cross above the axis "
        f"counts sequences without any estimate. Below: share of sequences within {NEAR_M:g} and "
        f"{LOCATED_M:g} m with 95 % Wilson intervals; failures count. Red: the paper ({PAPER}, "
        f"real robots). {counts}",
        localization_error_figure(_per_sequence(shown, "error_m"), colours),
    )
    yield ReportFigure(
        "fig12_spread",
        "Fig. 12: spread of the particles",
        "Standard deviation of the particles' positions. The paper's Fig. 12 shows the same "
        f"measure falling together with the error and prints no values. {counts}",
        spread_figure(_per_sequence(shown, "spread_m"), colours),
    )


def _per_sequence(drawn: list[Drawn], metric: str) -> dict[str, NDArray[np.float64]]:
    return {d.label: d.table.sequences(metric).to_numpy(np.float64) for d in drawn}


def refinement_figures(drawn: list[Drawn]) -> Iterator[ReportFigure]:
    """Fig. 13 and 14, side by side."""
    shown = [d for d in drawn if "after_translation_m" in d.table.trials()]
    if not shown:
        return
    counts = _counts(shown, [len(d.table.trials()) for d in shown], "trials")
    start = f"{_start(shown)} The number under each box is its median; refused alignments count. "
    for name, title, metric, draw, paper in (
        ("fig13_refinement_translation", "Fig. 13: translation", "translation_m",
         refinement_translation_figure, METRICS["refined_translation"].paper),
        ("fig14_refinement_angle", "Fig. 14: angle", "rotation_deg",
         refinement_angle_figure, METRICS["refined_rotation"].paper),
    ):  # fmt: skip
        pairs = {}
        for d in shown:
            trials = d.table.trials()
            pairs[d.label] = BeforeAfter(trials[f"before_{metric}"], trials[f"after_{metric}"])
        yield ReportFigure(
            name,
            f"{title} before and after refinement",
            f"{start}Dashed: the paper's median after ICP, {paper} over 67 depth maps, real "
            f"robots. {counts}",
            draw(pairs, [d.colour for d in shown]),
            wide=False,
        )


def _start(drawn: list[Drawn]) -> str:
    """Where refinements started: trials have the truth as another start, runs have not."""
    if not all("from_truth_translation_m" in d.table.trials() for d in drawn):
        return "Each surface starts where the particles place it."
    return (
        f"Trials start from the true pose with Gaussian noise of {published.START_NOISE_M.value} m "
        f"and {published.START_NOISE_DEG.value:g} deg per axis (the paper does not say whether "
        "per axis or in magnitude)."
    )


def _distinct(drawn: list[Drawn]) -> list[Drawn]:
    """Without conditions that differ in localization only and so have the same trials."""
    kept: list[Drawn] = []
    for d in drawn:
        if not any(_refined(d).equals(_refined(other)) for other in kept):
            kept.append(d)
    return kept


def _refined(drawn: Drawn) -> pd.Series:
    return drawn.table.trials().get("after_translation_m", pd.Series(dtype=np.float64))


def _timing(primary: Drawn) -> Iterator[ReportFigure]:
    stages = [stage.metric for stage in published.TABLE_I]
    durations = {stage: primary.table.values("timing", stage) for stage in stages}
    durations = {stage: values for stage, values in durations.items() if len(values)}
    if durations:
        yield ReportFigure(
            "table1_timing",
            "Table I: what each stage takes",
            f"Measured during the run, beside other work on the same cores; "
            f"{primary.condition.label()}. Paper: {published.PLATFORM}.",
            timing_figure(durations),
        )


def _counts(drawn: list[Drawn], counts: list[int], what: str) -> str:
    if len(set(counts)) == 1:
        listed = f"{counts[0]} {what}" + (" each" if len(counts) > 1 else "")
    else:
        listed = "; ".join(f"{n} {what} ({d.label})" for d, n in zip(drawn, counts, strict=True))
    return f"Here: {listed}; {_shared([d.condition for d in drawn])}."


def _shared(conditions: list[Condition]) -> str:
    """What all conditions have in common, then what differs."""
    if len(set(conditions)) == 1:
        return conditions[0].label()
    shared = shared_parts(conditions)
    return (f"all with {shared}: " if shared else "") + "; ".join(short_labels(conditions))

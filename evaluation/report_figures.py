"""All figures of the report, each with a caption that states its conditions."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TypeVar

from matplotlib.figure import Figure

from evaluation import published
from evaluation.figures.before_after import BeforeAfter
from evaluation.figures.fig05_15_augmented import augmented_figure
from evaluation.figures.fig06_depth_maps import depth_maps_figure
from evaluation.figures.fig07_height_maps import height_maps_figure
from evaluation.figures.fig08_particles import particles_figure
from evaluation.figures.fig11_localization_error import localization_error_figure
from evaluation.figures.fig12_spread import spread_figure
from evaluation.figures.fig13_refinement_translation import refinement_translation_figure
from evaluation.figures.fig14_refinement_angle import refinement_angle_figure
from evaluation.figures.table1_timing import timing_figure
from evaluation.results import Condition, ResultTable
from evaluation.scene_pictures import aerial_viewpoint, render_augmented_map, robot_viewpoint
from evaluation.showcase import Showcase

T = TypeVar("T")

COMPARED = 3
"""Conditions drawn side by side; more would not be told apart."""


@dataclass(frozen=True)
class ReportFigure:
    """A figure and what stands under it.

    Attributes:
        name: Of its files.
        title: For the heading.
        caption: What is shown, under which conditions, beside which published value.
        figure: The drawing.
        wide: Whether it needs the full width of a page.
    """

    name: str
    title: str
    caption: str
    figure: Figure
    wide: bool = True


def report_figures(
    table: ResultTable, conditions: Sequence[Condition], showcase: Showcase | None
) -> Iterator[ReportFigure]:
    """Draw what there is data for, in the order in which one would tell the story."""
    measured = {c: table.of(c).without_controls() for c in conditions}
    yield from _localization(measured)
    yield from _refinement(measured)
    if showcase is not None:
        yield from _showcase(showcase)
    yield from _timing(measured)


def _localization(measured: dict[Condition, ResultTable]) -> Iterator[ReportFigure]:
    compared = _first({c: t for c, t in measured.items() if len(t.sequences("error_m"))})
    if not compared:
        return
    counts = _counts({c: len(t.sequences("error_m")) for c, t in compared.items()}, "sequences")
    yield ReportFigure(
        "fig11_localization_error",
        "Fig. 11: localization error over the iterations",
        "Horizontal distance between the estimated and the true position of the MAV relative to "
        "the ground robot, no alignment applied. Boxes: median and quartiles; whiskers to 1.5 "
        "interquartile ranges; every outlier is drawn; a number with a cross above the axis "
        "counts sequences without any estimate. Below: share of sequences within 0.5 and "
        "0.25 m with 95 % Wilson intervals; failures stay in. Red: the paper (65 % within 0.5 m "
        f"at iteration 1, 89 % within 0.25 m after 4, 41 sequences, real robots). {counts}",
        localization_error_figure({c.label(): t.sequences("error_m") for c, t in compared.items()}),
    )
    yield ReportFigure(
        "fig12_spread",
        "Fig. 12: spread of the particles",
        "Standard deviation of the particles' positions. The paper's Fig. 12 shows the same "
        f"measure falling together with the error and prints no values. {counts}",
        spread_figure({c.label(): t.sequences("spread_m") for c, t in compared.items()}),
    )


def _refinement(measured: dict[Condition, ResultTable]) -> Iterator[ReportFigure]:
    trials = {c: t.trials() for c, t in measured.items()}
    shown = _first({c: t for c, t in trials.items() if "after_translation_m" in t})
    if not shown:
        return
    counts = _counts({c: len(t) for c, t in shown.items()}, "trials")
    start = (
        f"Trials start from the true pose with Gaussian noise of {published.START_NOISE_M.value} m "
        f"and {published.START_NOISE_DEG.value:g} deg per axis (the paper does not say whether "
        "per axis or in magnitude). The figure under each box is its median. "
    )
    for name, number, quantity, metric, draw, paper in (
        (
            "fig13_refinement_translation", 13, "translation", "translation_m",
            refinement_translation_figure, "0.076 m over 67 depth maps",
        ),
        (
            "fig14_refinement_angle", 14, "angle", "rotation_deg",
            refinement_angle_figure, "3.0 deg over 67 depth maps",
        ),
    ):  # fmt: skip
        pairs = {
            c.label(): BeforeAfter(t[f"before_{metric}"], t[f"after_{metric}"])
            for c, t in shown.items()
        }
        yield ReportFigure(
            name,
            f"Fig. {number}: {quantity} before and after refinement",
            f"{start}Dashed: the paper's median after ICP, {paper}, real robots. {counts}",
            draw(pairs),
            wide=False,
        )


def _showcase(showcase: Showcase) -> Iterator[ReportFigure]:
    conditions = f"Scene {showcase.scene}; {showcase.condition}."
    yield ReportFigure(
        "fig05_15_augmented",
        "Fig. 5 and 15: the augmented map",
        "Red: the ground robot's map. Grey: what the MAV added after refinement. Pyramids mark "
        f"cameras along the paths. {conditions}",
        augmented_figure(
            render_augmented_map(showcase, robot_viewpoint(showcase)),
            render_augmented_map(showcase, aerial_viewpoint(showcase)),
        ),
    )
    yield ReportFigure(
        "fig06_depth_maps",
        "Fig. 6: depth maps and their fusion",
        "Single depth maps, the surface fused from several, and the distance of every point to "
        "the true surface. Pale pixels were rejected; the curve counts them as never within. "
        f"The paper shows such maps without an error. {conditions}",
        depth_maps_figure(showcase),
    )
    yield ReportFigure(
        "fig07_height_maps",
        "Fig. 7: height maps and cost map",
        "Pale cells were not seen. Red: outline of the aerial map where its cost is lowest. "
        f"Dark is a low cost; no cost where the overlap is too small. {conditions}",
        height_maps_figure(showcase),
    )
    yield ReportFigure(
        "fig08_particles",
        "Fig. 8: particles over successive aerial maps",
        "Green: particles after taking in the map; white: their covariance (2 sigma); cross: "
        "the truth. Behind them the cost of every position, computed for the picture; the "
        f"filter itself evaluates particles only after the first map. {conditions}",
        particles_figure(showcase.steps),
    )


def _timing(measured: dict[Condition, ResultTable]) -> Iterator[ReportFigure]:
    condition, table = next(iter(measured.items()))
    durations = {
        stage.metric: table.values("timing", stage.metric)
        for stage in published.TABLE_I
        if len(table.values("timing", stage.metric))
    }
    if durations:
        yield ReportFigure(
            "table1_timing",
            "Table I: what each stage takes",
            f"Measured during the run itself, so beside other work on the same cores; "
            f"{condition.label()}. Paper: {published.PLATFORM}.",
            timing_figure(durations),
        )


def _first(measured: dict[Condition, T]) -> dict[Condition, T]:
    return dict(list(measured.items())[:COMPARED])


def _counts(counts: dict[Condition, int], what: str) -> str:
    """ "41 sequences each" or the number for every condition."""
    if len(set(counts.values())) == 1:
        number = next(iter(counts.values()))
        each = " each" if len(counts) > 1 else ""
        return f"Here: {number} {what}{each}; " + "; ".join(c.label() for c in counts) + "."
    return "Here: " + "; ".join(f"{n} {what} ({c.label()})" for c, n in counts.items()) + "."

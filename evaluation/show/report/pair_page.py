"""`report.html` of a run over two recordings of a user's own."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from evaluation.run.own_pair import PairResult, pair_table
from evaluation.run.surface_log import LoggedSurface
from evaluation.show.figures.pair_surfaces import depth_figure, place_figure
from evaluation.show.figures.style import ReportFigure
from evaluation.show.report.page import rendered, saved_picture


def write_pair_page(folder: Path, name: str, summary: dict[str, Any], result: PairResult) -> None:
    """Write `report.html` and `figures/` of a run into its folder; `name` names the recordings."""
    figures = pair_figures(result.surfaces.shown())
    page = rendered(
        "pair.html.j2",
        name=name,
        preset=summary["preset"],
        replaced=summary["replaced"],
        why=summary["why"],
        table=pair_table(summary),
        pictures=[saved_picture(drawn, folder) for drawn in figures],
    )
    (folder / "report.html").write_text(page, encoding="utf-8")


def pair_figures(surfaces: list[LoggedSurface]) -> Iterator[ReportFigure]:
    """Pictures of some surfaces; none without a surface."""
    if not surfaces:
        return
    yield ReportFigure(
        "surfaces",
        "Aerial surfaces and measured depth",
        "Blue is too near, red too far; grey pixels have no depth. Differences are along the "
        "optical axis, at the pixels of the reference view. They include the errors of the depth "
        "camera and of its registration.",
        depth_figure(surfaces),
    )
    yield ReportFigure(
        "places",
        "Aerial surfaces in the ground robot's map",
        "Heights of both maps over the same square, in the same colours; pale cells have none. The "
        "surface is drawn where refinement put it, else where localization claimed it; a title "
        "other than 'aligned' is the reason of the refusal.",
        place_figure(surfaces),
    )

"""The figures that look closely at one flight: what was seen, mapped and believed."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from matplotlib.figure import Figure

from evaluation.measure.baselines.matched_images import MatchedImages
from evaluation.measure.showcase import Showcase
from evaluation.show.figures.augmented_map import augmented_figure, refinement_figure
from evaluation.show.figures.depth_maps import depth_maps_figure
from evaluation.show.figures.height_maps import height_maps_figure
from evaluation.show.figures.matches import DRAWN, matches_figure, views_figure
from evaluation.show.figures.particles import particles_figure
from evaluation.show.figures.scene_pictures import (
    aerial_viewpoint,
    render_augmented_map,
    robot_viewpoint,
)


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


def showcase_figures(showcase: Showcase) -> Iterator[ReportFigure]:
    """Fig. 2, 3, 5 and 15, 6, 7 and 8 of one flight, and a refinement."""
    conditions = f"Scene {showcase.scene}; {showcase.condition}."
    yield ReportFigure(
        "fig02_views",
        "Fig. 2: the same scene from both robots",
        f"Images as the pipeline gets them. {conditions}",
        views_figure(showcase.mav_image, showcase.ground_image),
    )
    if showcase.matched is not None:
        yield _matches(showcase.matched, conditions)
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
        "Single depth maps, the surface fused from several, and how much each is too near (blue) "
        "or too far (red). Grey pixels were rejected; the curve counts them as never within. "
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
        "the truth. Behind them the cost of every position. " + conditions,
        particles_figure(showcase.steps),
    )
    if showcase.T_ground_mav is not None:
        yield ReportFigure(
            "refinement",
            "Section VII: one refinement",
            "A cut through both maps, 3 cm thick, where the ground robot's map has most of the "
            "heap: the aerial surface as the particles place it, and as refinement does. The "
            f"paper shows no such picture. {conditions}",
            refinement_figure(showcase, showcase.T_ground_mav),
        )


def _matches(matched: MatchedImages, conditions: str) -> ReportFigure:
    verdict = "enough" if matched.located else "too few"
    return ReportFigure(
        "fig03_matches",
        "Fig. 3: feature matching between aerial and ground image",
        "ASIFT with the ratio test. Green: matches that agree on one pose of the MAV's camera, "
        f"given the ground robot's depth ({verdict} to claim it); red: the others; at most "
        f"{DRAWN} of each are drawn. Of "
        f"{matched.views} ground views near the place, the one with most green ones. The paper "
        f"found matches indoors on planar textured surfaces, and none outdoors. {conditions}",
        matches_figure(matched),
    )

"""Figures of one flight with their captions: images, maps, depth, costs, particles, refinement."""

from __future__ import annotations

from collections.abc import Iterator

from evaluation.measure.baselines.matched_images import MatchedImages
from evaluation.measure.showcase import Showcase
from evaluation.show.figures.fig02_03_matches import DRAWN, matches_figure, views_figure
from evaluation.show.figures.fig05_15_augmented_map import (
    ADDED,
    BELIEVED,
    as_believed,
    augmented_figure,
    refinement_figure,
)
from evaluation.show.figures.fig06_depth_maps import depth_maps_figure
from evaluation.show.figures.fig07_height_maps import height_maps_figure
from evaluation.show.figures.fig08_particles import ZOOM_M, particles_figure
from evaluation.show.figures.scene_pictures import (
    aerial_viewpoint,
    render_augmented_map,
    robot_viewpoint,
)
from evaluation.show.figures.style import ReportFigure


def showcase_figures(showcase: Showcase) -> Iterator[ReportFigure]:
    """Fig. 2, 3, 5 and 15, 6, 7 and 8 of one flight, and a refinement."""
    conditions = f"Scene {showcase.scene}; {showcase.condition}."
    yield ReportFigure(
        "fig02_views",
        "Fig. 2: the same scene from both robots",
        f"Images as the pipeline receives them. {conditions}",
        views_figure(showcase.mav_image, showcase.ground_image),
    )
    if showcase.matched is not None:
        yield _matches(showcase.matched, conditions)
    yield _augmented(showcase, conditions)
    yield ReportFigure(
        "fig06_depth_maps",
        "Fig. 6: depth maps and their fusion",
        "Single depth maps, the surface fused from several, and the error of each: blue is too "
        "near, red too far, grey pixels were rejected. The curves show the share of all pixels "
        "within an error; a rejected pixel counts as outside. The paper shows depth maps without "
        f"errors. {conditions}",
        depth_maps_figure(showcase),
    )
    yield ReportFigure(
        "fig07_height_maps",
        "Fig. 7: height maps and cost map",
        "Pale cells have no height, or no cost because the overlap is too small. Dark is a low "
        f"cost. Red: outline of the aerial map at the lowest cost. {conditions}",
        height_maps_figure(showcase),
    )
    yield ReportFigure(
        "fig08_particles",
        "Fig. 8: particles over successive aerial maps",
        "Green: particles after the update with each map. White: their covariance (2 sigma). "
        "Cross: true position. Background: cost of every position. Inset: "
        f"{200 * ZOOM_M:.0f} cm around the estimate, where the spread is small. {conditions}",
        particles_figure(showcase.steps),
    )
    if showcase.T_ground_mav is not None:
        yield ReportFigure(
            "refinement",
            "Section VII: one refinement",
            "Cut through both maps, 3 cm thick, at the place where both contain most of the heap. "
            "Above: the aerial surface as placed by the particles; below: after refinement. The "
            f"paper shows no such picture. {conditions}",
            refinement_figure(showcase, showcase.T_ground_mav),
        )


def _augmented(showcase: Showcase, conditions: str) -> ReportFigure:
    """The augmented map; where nothing was added, the surface where it was last believed."""
    nothing = len(showcase.aerial_cloud) == 0
    shown = as_believed(showcase) if nothing else showcase
    grey = (
        "Nothing was added to it: no alignment was accepted. Grey: the first aerial surface where "
        "the last belief drawn in Fig. 8 places it."
        if nothing
        else "Grey: points added by the MAV after refinement."
    )
    return ReportFigure(
        "fig05_15_augmented",
        "Fig. 5 and 15: the augmented map",
        f"Red: the ground robot's map. {grey} Pyramids mark cameras along the paths. {conditions}",
        augmented_figure(
            render_augmented_map(shown, robot_viewpoint(shown)),
            render_augmented_map(shown, aerial_viewpoint(shown)),
            BELIEVED if nothing else ADDED,
        ),
    )


def _matches(matched: MatchedImages, conditions: str) -> ReportFigure:
    verdict = "enough" if matched.located else "too few"
    return ReportFigure(
        "fig03_matches",
        "Fig. 3: feature matching between aerial and ground image",
        "ASIFT with the ratio test. Green: matches that agree on one pose of the MAV's camera, "
        f"given the ground robot's depth ({verdict} to claim this pose). Red: the other matches. "
        f"At most {DRAWN} of each are drawn. Of {matched.views} ground views near the place, the "
        "one with most green matches is shown. The paper found matches indoors on planar textured "
        f"surfaces, and none outdoors. {conditions}",
        matches_figure(matched),
    )

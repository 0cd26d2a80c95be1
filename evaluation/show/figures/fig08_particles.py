"""Fig. 8: the particles over successive aerial maps."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke
from numpy.typing import NDArray

from evaluation.measure.showcase import LocalizationStep
from evaluation.show.figures.fig07_height_maps import draw_costs, mark_truth, square_panel
from evaluation.show.figures.style import HOLE, WIDE_IN, styled

PARTICLES = "#35C46A"
SIGMAS = 2.0
"""Half axes of the covariance ellipse, in standard deviations."""
ELLIPSE_STEPS = 48
ZOOM_BELOW_M = 0.25
"""Particles with a smaller spread are also drawn enlarged."""
ZOOM_M = 0.3
"""Half the side of the enlarged square."""
ZOOM_SIDE = 0.36
"""Side of the inset, as a share of its panel's."""
LARGEST_PANEL_IN = 3.6
"""Height of a panel that is alone [in]."""


@styled
def particles_figure(steps: tuple[LocalizationStep, ...]) -> Figure:
    """One panel per aerial map: cost map, particles, their covariance (2 sigma), the truth."""
    side = min(WIDE_IN / len(steps), LARGEST_PANEL_IN)
    figure = Figure(figsize=(WIDE_IN, side + 0.75), layout="constrained")
    panels = figure.subplots(1, len(steps), squeeze=False)[0]
    for number, (axes, step) in enumerate(zip(panels, steps, strict=True), 1):
        _draw_step(axes, step)
        error = float(np.linalg.norm(step.belief.estimate[:2] - step.true_u))
        axes.set_title(f"{number}  error {error:.2f} m\nspread {step.belief.spread_m:.2f} m")
        axes.set_xlabel("x [m]")
        square_panel(axes)
        if step.belief.spread_m < ZOOM_BELOW_M:
            _zoom(axes, step)
    panels[0].set_ylabel("y [m]")
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside lower right", ncols=2)
    return figure


def _draw_step(axes: Axes, step: LocalizationStep) -> None:
    belief = step.belief
    draw_costs(axes, step.cost_map)
    axes.plot(
        *belief.particles[:, :2].T, ".", color=PARTICLES, markersize=3.6, markeredgewidth=0,
        alpha=0.85, label=f"{len(belief.particles)} particles",
    )  # fmt: skip
    outline = ellipse_points(belief.estimate[:2], belief.covariance)
    shadow = [withStroke(linewidth=2.1, foreground="#555555")]
    axes.plot(*outline.T, color="white", linewidth=1.3, zorder=4, path_effects=shadow)
    mark_truth(axes, step.true_u)


def _zoom(axes: Axes, step: LocalizationStep) -> None:
    """A square of 0.6 m around the estimate, in the corner farthest from estimate and truth."""
    limits = np.array([axes.get_xlim(), axes.get_ylim()])
    u = step.belief.estimate[:2]
    marks = (np.array([u, step.true_u]) - limits[:, 0]) / np.ptp(limits, axis=1)
    corners = np.array([[x, y] for y in (0.62, 0.02) for x in (0.62, 0.02)])
    distances = np.linalg.norm(corners[:, None] + ZOOM_SIDE / 2 - marks, axis=2)
    inset = axes.inset_axes((*corners[distances.min(axis=1).argmax()], ZOOM_SIDE, ZOOM_SIDE))
    _draw_step(inset, step)
    (left, bottom), (right, top) = u - ZOOM_M, u + ZOOM_M
    inset.set(xlim=(left, right), ylim=(bottom, top), xticks=[], yticks=[], facecolor=HOLE)
    for spine in inset.spines.values():
        spine.set_visible(True)
    axes.indicate_inset_zoom(inset, edgecolor="black", alpha=0.7)


def ellipse_points(mean: NDArray, covariance: NDArray) -> NDArray[np.float64]:
    """(N, 2) a closed line around a 2-D Gaussian, `SIGMAS` standard deviations from its mean."""
    variances, axes = np.linalg.eigh(covariance)
    angle = np.linspace(0, 2 * np.pi, ELLIPSE_STEPS + 1)
    circle = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    return mean + SIGMAS * (circle * np.sqrt(np.maximum(variances, 0))) @ axes.T

"""Fig. 8: the particles over successive aerial maps."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke
from numpy.typing import NDArray

from evaluation.measure.showcase import LocalizationStep
from evaluation.show.figures.fig07_height_maps import draw_costs, mark_truth
from evaluation.show.figures.style import WIDE_IN, styled

PARTICLES = "#35C46A"
SIGMAS = 2.0
"""Half axes of the covariance ellipse, in standard deviations."""
ELLIPSE_STEPS = 48
ZOOM_BELOW_M = 0.25
"""Particles with a smaller spread are also drawn enlarged."""
ZOOM_M = 0.3
"""Half the side of the enlarged square."""


@styled
def particles_figure(steps: tuple[LocalizationStep, ...]) -> Figure:
    """One panel per aerial map: cost map, particles, their covariance (2 sigma), the truth."""
    figure = Figure(figsize=(WIDE_IN, WIDE_IN / len(steps) + 0.35), layout="constrained")
    panels = figure.subplots(1, len(steps), squeeze=False)[0]
    for number, (axes, step) in enumerate(zip(panels, steps, strict=True), 1):
        _draw_step(axes, step)
        error = float(np.linalg.norm(step.belief.estimate[:2] - step.true_u))
        axes.set_title(f"{number}  error {error:.2f} m, spread {step.belief.spread_m:.2f} m")
        axes.set_xlabel("x [m]")
        if step.belief.spread_m < ZOOM_BELOW_M:
            _zoom(axes, step)
    panels[0].set_ylabel("y [m]")
    panels[0].legend(loc="upper left", frameon=True, framealpha=0.9)
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
    """A square of 0.6 m around the truth, in the corner farthest from it."""
    x, y = step.true_u
    left, right, bottom, top = *axes.get_xlim(), *axes.get_ylim()
    column = 0.62 if x < (left + right) / 2 else 0.02
    row = 0.62 if y < (bottom + top) / 2 else 0.02
    inset = axes.inset_axes((column, row, 0.36, 0.36))
    _draw_step(inset, step)
    inset.set(xlim=(x - ZOOM_M, x + ZOOM_M), ylim=(y - ZOOM_M, y + ZOOM_M), xticks=[], yticks=[])
    for spine in inset.spines.values():
        spine.set_visible(True)
    axes.indicate_inset_zoom(inset, edgecolor="black", alpha=0.7)


def ellipse_points(mean: NDArray, covariance: NDArray) -> NDArray[np.float64]:
    """(N, 2) a closed line around a 2-D Gaussian, `SIGMAS` standard deviations from its mean."""
    variances, axes = np.linalg.eigh(covariance)
    angle = np.linspace(0, 2 * np.pi, ELLIPSE_STEPS + 1)
    circle = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    return mean + SIGMAS * (circle * np.sqrt(np.maximum(variances, 0))) @ axes.T

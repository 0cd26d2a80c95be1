"""Fig. 8: the particles over three successive aerial maps."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Ellipse
from numpy.typing import NDArray

from evaluation.figures.maps import draw_costs, mark_truth
from evaluation.figures.style import styled
from evaluation.showcase import LocalizationStep

PARTICLES = "#35C46A"


@styled
def particles_figure(steps: tuple[LocalizationStep, ...]) -> Figure:
    """One panel a step: cost map, particles, their covariance (2 sigma), the truth."""
    figure = Figure(figsize=(3.85 * len(steps), 4.2), layout="constrained")
    panels = figure.subplots(1, len(steps), squeeze=False)[0]
    for number, (axes, step) in enumerate(zip(panels, steps, strict=True), 1):
        made, belief = step.cost_map, step.belief
        draw_costs(axes, made.costs, made.origin, made.cells_per_m)
        axes.plot(
            *belief.particles[:, :2].T,
            ".",
            color=PARTICLES,
            markersize=4.5,
            markeredgewidth=0,
            alpha=0.85,
            label=f"{len(belief.particles)} particles",
        )
        axes.add_patch(covariance_ellipse(belief.estimate[:2], belief.covariance))
        mark_truth(axes, step.true_u)
        error = float(np.linalg.norm(belief.estimate[:2] - step.true_u))
        axes.set_title(f"aerial map {number}: off by {error:.2f} m, spread {belief.spread_m:.2f} m")
        axes.title.set_fontsize(9.5)
        axes.set_xlabel("x [m]")
    panels[0].set_ylabel("y [m]")
    panels[0].legend(loc="lower left", frameon=True, framealpha=0.9)
    return figure


def covariance_ellipse(mean: NDArray, covariance: NDArray, sigmas: float = 2.0) -> Ellipse:
    """White outline of a 2-D Gaussian; widths are 2 * sigmas standard deviations."""
    variances, axes = np.linalg.eigh(covariance)
    width, height = 2 * sigmas * np.sqrt(np.maximum(variances, 1e-8))
    angle = np.degrees(np.arctan2(axes[1, 0], axes[0, 0]))
    return Ellipse(
        tuple(mean), width, height, angle=angle, fill=False, edgecolor="white", linewidth=1.8
    )

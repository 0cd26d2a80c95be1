"""Whether a belief may claim a position (Sec. VIII-C, and what the paper leaves open)."""

from __future__ import annotations

import numpy as np

from airground.config import Localization
from airground.core.agreement import Agreement
from airground.core.arrays import F64
from airground.localization.cost_map import Overlays
from airground.localization.particles import densest_mode


def why_refused(overlay: Overlays, agreed: Agreement, particles: F64, config: Localization) -> str:
    """The reason, in one line, why no position is claimed; empty if one is.

    The particles' covariance says whether they agree with each other, not whether they are
    right: the rest asks whether the maps fit at the estimate, better than beside it.

    Args:
        overlay: Overlap of the newest aerial map with the ground map at the estimate.
        agreed: Agreement of the maps at the estimate.
        particles: (M, 3) particles: x, y [m] and heading [rad].
        config: Section `localization` of the configuration.
    """
    overlap = float(overlay.overlaps()[0])
    if not overlap > config.min_overlap:
        return f"only {overlap:.0%} of the aerial map lies on the ground map at the estimate"
    relief = float(overlay.reliefs()[0])
    if relief < config.min_relief_m:
        return f"no structure: heights deviate by {1000 * relief:.0f} mm where the maps overlap"
    refusal = _why_spread(particles, config)
    if refusal:
        return refusal
    correlation = float(overlay.correlations()[0])
    if correlation < config.min_correlation:
        return f"heights at the estimate correlate by {correlation:.2f} only"
    if agreed.kappa < config.min_agreement:
        return (
            f"heights agree over {agreed.share:.0%} at the estimate, "
            f"and over {agreed.chance:.0%} beside it: that may be chance"
        )
    return ""


def _why_spread(particles: F64, config: Localization) -> str:
    """Refuses particles that are spread; with `mode`, a minority elsewhere is allowed."""
    counted = particles
    if config.estimate == "mode":
        mode = densest_mode(particles)
        if mode.mean() < config.min_mode_share:
            return f"only {mode.mean():.0%} of the particles agree on a place"
        counted = particles[mode]
    spread_m = float(np.sqrt(np.trace(np.cov(counted[:, :2].T))))
    if spread_m > config.converged_spread_m:
        return f"the particles are still spread over {spread_m:.2f} m"
    return ""

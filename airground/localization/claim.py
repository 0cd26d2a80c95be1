"""Whether a belief may claim a position: Sec. VIII-C, and what the paper leaves open."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from airground.config import Localization
from airground.core.agreement import Agreement
from airground.core.arrays import F64
from airground.localization.cost_map import Overlays
from airground.localization.particles import densest_mode


@dataclass(frozen=True, slots=True)
class Fit:
    """How the two maps fit at one hypothesis.

    Attributes:
        overlay: Overlap of the aerial map, which may be several surfaces as one, at one hypothesis.
        agreed: Agreement of the heights there, and beside it.
        newest_overlap: Share of the newest surface alone that lies over the ground map there.
        newest_agreed: Agreement of its heights.
        evidence: How much likelier the heights are than independent ones, as a logarithm [nat]:
            minus the cost, where costs are such; else infinite.
        lead: How much likelier this place is than any other, likewise.
    """

    overlay: Overlays
    agreed: Agreement
    newest_overlap: float
    newest_agreed: Agreement
    evidence: float = math.inf
    lead: float = math.inf


def why_refused(fit: Fit, particles: F64, config: Localization) -> str:
    """The reason, in one line, why no position is claimed; empty if one is.
    Its kind comes first: no overlap, no structure, particles split, heights disagree or ambiguous.

    The covariance says whether particles agree with each other, not whether they are right: the
    rest asks whether the maps fit at the estimate, better than beside it.

    Args:
        fit: Of the two maps, at the estimate.
        particles: (M, 3) particles: x, y [m] and heading [rad].
        config: Section `localization` of the configuration.
    """
    overlay = fit.overlay
    overlap = float(overlay.overlaps()[0])
    if not overlap > config.min_overlap:
        return f"no overlap: only {overlap:.0%} of the aerial map lies on the ground map"
    if fit.newest_overlap < config.min_claimed_overlap:
        return (
            f"no overlap: only {fit.newest_overlap:.0%} of the newest aerial map lies on the "
            f"ground map, {config.min_claimed_overlap:.0%} are needed for a claim"
        )
    relief = float(overlay.reliefs()[0])
    if relief < config.min_relief_m:
        return f"no structure: heights deviate by {1000 * relief:.0f} mm where the maps overlap"
    refusal = _why_spread(particles, config)
    if refusal:
        return refusal
    correlation = float(overlay.correlations()[0])
    if correlation < config.min_correlation:
        return f"heights disagree: at the estimate they correlate by {correlation:.2f} only"
    if fit.evidence < config.min_evidence:
        return (
            f"heights disagree: that they fit over {overlap:.0%} of the aerial map may be chance "
            f"({fit.evidence:.0f} nat, {config.min_evidence:g} are enough)"
        )
    # Several surfaces as one can agree by chance while the newest lies among other boxes.
    for those, agreed in (("they", fit.agreed), ("the newest", fit.newest_agreed)):
        if agreed.kappa < config.min_agreement:
            return (
                f"heights disagree: {those} agree over {agreed.share:.0%} at the estimate, "
                f"and over {agreed.chance:.0%} beside it, which may be chance"
            )
    if fit.lead < config.min_lead:
        return (
            f"ambiguous: another place fits nearly as well ({fit.lead:.1f} nat between them, "
            f"{config.min_lead:g} are needed)"
        )
    return ""


def _why_spread(particles: F64, config: Localization) -> str:
    """Refuses particles that are spread; with `mode`, a minority elsewhere is allowed."""
    counted = particles
    if config.estimate == "mode":
        mode = densest_mode(particles)
        if mode.mean() < config.min_mode_share:
            return f"particles split: only {mode.mean():.0%} of them agree on a place"
        counted = particles[mode]
    if len(counted) < 2:
        return "particles split: no two of them agree on a place"
    spread_m = float(np.sqrt(np.trace(np.cov(counted[:, :2].T))))
    if spread_m > config.converged_spread_m:
        return f"particles split: they are still spread over {spread_m:.2f} m"
    return ""

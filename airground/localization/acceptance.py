"""Whether a belief may claim a position (Sec. VIII-C, and what the paper leaves open)."""

from __future__ import annotations

import numpy as np

from airground.config import Localization
from airground.localization.cost_map import Overlays


def why_refused(overlay: Overlays, spread_m: float, config: Localization) -> str:
    """One line on why no position is claimed; empty if one is.

    Args:
        overlay: The newest aerial map laid at the estimate.
        spread_m: Standard deviation of the particles' positions.
        config: Thresholds.
    """
    overlap = float(overlay.overlaps()[0])
    if not overlap > config.min_overlap:
        return f"only {overlap:.0%} of the aerial map lies on the ground map at the estimate"
    relief = float(overlay.reliefs()[0])
    if relief < config.min_relief_m:
        return f"no structure: heights deviate by {1000 * relief:.0f} mm where the maps overlap"
    correlation = float(overlay.correlations()[0])
    if correlation < 1.0 - config.max_cost:
        return f"heights at the estimate correlate only by {correlation:.2f}"
    if spread_m > config.converged_spread_m:
        return f"particles are still spread over {spread_m:.2f} m"
    return ""

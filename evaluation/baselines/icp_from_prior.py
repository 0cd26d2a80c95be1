"""ICP from the prior alone: the paper's Section VII without a search before it."""

from __future__ import annotations

from evaluation.baselines.registration import settled_by_icp, too_few_points
from evaluation.baselines.seam import Answer, Given


def icp_from_prior(given: Given) -> Answer:
    """Point-to-plane ICP started at the prior."""
    if given.prior is None:
        return Answer(None, "there is no prior to start from")
    refusal = too_few_points(given)
    if refusal:
        return Answer(given.prior, refusal)
    return settled_by_icp(given, given.prior)

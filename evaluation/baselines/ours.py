"""Ours, for the same table: the first aerial map alone, and refinement from a prior."""

from __future__ import annotations

from airground.core.se3 import SE3
from airground.localization.particle_filter import MonteCarloLocalizer
from airground.pipeline import locate
from airground.refinement import refine
from evaluation.baselines.seam import Answer, Given


def first_belief(given: Given) -> Answer:
    """Particles after one aerial map: iteration 1 of Fig. 11."""
    if given.sighting.heading is None and given.config.localization.heading == "known":
        return Answer(None, "the heading is unknown")
    localizer = MonteCarloLocalizer(given.config, given.rng)
    for _ in locate(localizer, given.sighting):
        pass
    belief = localizer.belief
    assert belief is not None
    return Answer(belief.T_ground_mav, belief.refusal)


def first_belief_refined(given: Given) -> Answer:
    """The same, refined; claimed where both the particles and the refinement claim it."""
    found = first_belief(given)
    if found.T_ground_mav is None:
        return found
    refined = _refined(given, found.T_ground_mav)
    return Answer(refined.T_ground_mav, found.refusal or refined.refusal)


def refined_from_prior(given: Given) -> Answer:
    """Refinement (Sec. VII) started at the prior."""
    if given.prior is None:
        return Answer(None, "there is no prior to start from")
    return _refined(given, given.prior)


def _refined(given: Given, start: SE3) -> Answer:
    surface, ground = given.sighting.surface, given.sighting.ground_cloud
    alignment = refine(surface.stamp_ns, start, surface.cloud_mav, ground, given.config)
    return Answer(alignment.T_ground_mav, alignment.refusal)

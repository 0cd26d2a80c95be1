"""Every baseline by name: a new one is a file of its own and a line here."""

from __future__ import annotations

from evaluation.baselines.asift import asift
from evaluation.baselines.fpfh_ransac import fpfh_ransac_icp
from evaluation.baselines.icp_from_prior import icp_from_prior
from evaluation.baselines.kiss_matcher import kiss_matcher_icp
from evaluation.baselines.ncc import ncc_search
from evaluation.baselines.ours import first_belief, first_belief_refined, refined_from_prior
from evaluation.baselines.phase_correlation import phase_correlation
from evaluation.baselines.seam import Baseline
from evaluation.baselines.sift import sift
from evaluation.baselines.zmssd import zmssd_search

IMAGES = "images, the near ones told by the noisy prior; depth of the ground robot"
HEIGHTS = "height maps, heading, search region"
CLOUDS = "clouds, vertical, heading, search region"

BASELINES = (
    Baseline("sift", "SIFT and PnP", IMAGES, sift, views=True),
    Baseline("asift", "ASIFT and PnP", IMAGES, asift, views=True),
    Baseline("zmssd", "ZMSSD of height maps (Eq. 3)", HEIGHTS, zmssd_search),
    Baseline("ncc", "plain NCC of height maps", HEIGHTS, ncc_search),
    Baseline(
        "phase",
        "masked phase correlation",
        HEIGHTS,
        phase_correlation,
        module="skimage.registration",
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

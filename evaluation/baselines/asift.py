"""ASIFT matching between aerial and ground images (Morel and Yu, SIAM J. Imaging Sci. 2009).

SIFT on many simulated tilts of both images: the matching that the paper tried (Fig. 3).
"""

from __future__ import annotations

import cv2

from evaluation.baselines.appearance import located_by_appearance
from evaluation.baselines.seam import Answer, Given


def asift_detector() -> cv2.Feature2D:
    """SIFT under the tilts and rotations that its authors advise, as OpenCV has them."""
    return cv2.AffineFeature.create(cv2.SIFT.create())


def asift(given: Given) -> Answer:
    """Where ASIFT features put the MAV's camera."""
    return located_by_appearance(given, asift_detector())

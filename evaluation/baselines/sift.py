"""SIFT matching between aerial and ground images (Lowe, IJCV 2004)."""

from __future__ import annotations

import cv2

from evaluation.baselines.appearance import located_by_appearance
from evaluation.baselines.seam import Answer, Given


def sift(given: Given) -> Answer:
    """Where SIFT features put the MAV's camera."""
    return located_by_appearance(given, cv2.SIFT.create())

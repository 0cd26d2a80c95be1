"""Corners of one image in another (Lucas and Kanade, in pyramids)."""

from __future__ import annotations

import cv2
import numpy as np

from airground.core.arrays import F32, U8, Mask

MAX_DIFFERENCE = 22.0
"""Largest mean absolute difference of two patches of the same place [grey levels]."""
MIN_BRIGHTNESS = 4.0
"""Least mean brightness of a usable image [grey levels]."""
BORDER_PX = 4.0


def flow(
    image: U8, other: U8, pixels: F32, start: F32, window_px: int, levels: int
) -> tuple[F32, Mask]:
    """Follow corners from `image` to `other`.

    Args:
        image, other: (height, width) grey images; a difference in exposure is removed first.
        pixels: (N, 2) pixels of the corners in `image`.
        start: (N, 2) pixels in `other` at which the search begins.
        window_px: Side of the patches [px].
        levels: Pyramid levels above the full resolution.

    Returns:
        (N, 2) corners in `other` and (N,) which of them were found.
    """
    brightness, other_brightness = cv2.mean(image)[0], cv2.mean(other)[0]
    if len(pixels) == 0 or min(brightness, other_brightness) < MIN_BRIGHTNESS:
        return start.copy(), np.zeros(len(pixels), bool)
    moved, status, difference = cv2.calcOpticalFlowPyrLK(
        image,
        brightened(other, brightness / other_brightness),
        np.ascontiguousarray(pixels, np.float32).reshape(-1, 1, 2),
        np.array(start, np.float32).reshape(-1, 1, 2),
        winSize=(window_px, window_px),
        maxLevel=levels,
        criteria=(cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 20, 0.02),
        flags=cv2.OPTFLOW_USE_INITIAL_FLOW,
        minEigThreshold=1e-3,
    )
    found_px = moved.reshape(-1, 2).astype(np.float32)
    height, width = image.shape
    inside = (found_px >= BORDER_PX).all(axis=1)
    inside &= (found_px[:, 0] < width - BORDER_PX) & (found_px[:, 1] < height - BORDER_PX)
    found = (status.ravel() == 1) & inside & (difference.ravel() < MAX_DIFFERENCE)
    return found_px, found


def flow_both_ways(
    image: U8, other: U8, pixels: F32, start: F32, window_px: int, levels: int, max_return_px: float
) -> tuple[F32, Mask]:
    """`flow`, keeping only corners that come back to where they began."""
    there, found = flow(image, other, pixels, start, window_px, levels)
    back, found_back = flow(other, image, there[found], pixels[found], window_px, 0)
    returned = np.linalg.norm(back - pixels[found], axis=1) < max_return_px
    found[found] = found_back & returned
    return there, found


def brightened(image: U8, gain: float) -> U8:
    """`image` times a gain; itself where that hardly changes it."""
    if abs(gain - 1.0) < 0.02:
        return image
    return cv2.convertScaleAbs(image, alpha=gain).astype(np.uint8, copy=False)

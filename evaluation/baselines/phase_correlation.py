"""Masked phase correlation of height maps (Padfield, IEEE Trans. Image Processing 2012)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from airground.core.height_map import lattice_index
from evaluation.baselines.height_overlay import MIN_OVERLAP, answer_at, height_maps
from evaluation.baselines.seam import Answer, Given


def phase_correlation(given: Given) -> Answer:
    """Register the height maps as images with holes, by scikit-image.

    Its overlap rule is a share of the largest overlap of any offset. An offset outside of
    the search region is refused; any other is claimed.
    """
    from skimage.registration import phase_cross_correlation

    maps = height_maps(given)
    if maps is None:
        return Answer(None, "the heading is unknown")
    ground, ground_mask = _image(maps.ground.heights)
    aerial, aerial_mask = _image(_padded(maps.aerial.heights, ground.shape))
    if not (ground_mask.any() and aerial_mask.any()):
        return Answer(None, "a height map is empty")
    shift, _, _ = phase_cross_correlation(
        ground,
        aerial,
        reference_mask=ground_mask,
        moving_mask=aerial_mask,
        overlap_ratio=MIN_OVERLAP,
    )
    # The shift moves arrays; the maps' places on the lattice make it one of the camera.
    offset = np.rint(shift) + lattice_index(maps.ground) - lattice_index(maps.aerial)
    position = offset / maps.ground.cells_per_m
    found = answer_at(given, maps, position)
    if (np.abs(position - maps.centre) > maps.radius_m).any():
        return Answer(found.T_ground_mav, "the best offset lies outside of the search region")
    return found


def _padded(heights: NDArray[np.float32], shape: tuple[int, ...]) -> NDArray[np.float32]:
    """The map with holes added up to a shape: images of one size have one centre."""
    after = [(0, max(0, wanted - size)) for size, wanted in zip(heights.shape, shape, strict=True)]
    return np.pad(heights, after, constant_values=np.nan)


def _image(heights: NDArray[np.float32]) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Heights about their mean with 0 in holes, and which pixels are none."""
    mask = np.isfinite(heights)
    mean = heights[mask].mean(dtype=np.float64) if mask.any() else 0.0
    return np.where(mask, heights - mean, 0.0), mask

"""Where an error counts as a success: one definition for every table, figure and verdict."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

NEAR_M = 0.50
"""Limit of the horizontal error after the first aerial map, as in the paper (Fig. 11) [m]."""
LOCATED_M = 0.25
"""Limit after the fourth, as in the paper; beyond it a claimed position is wrong [m]."""
FIRST_MAP, FOURTH_MAP = 1, 4
"""Aerial maps after which the paper states how many sequences are located."""
REFINED_M, REFINED_DEG = 0.05, 2.0
"""Limits of a good refinement [m, deg]: less than the paper's median errors, 7.6 cm and 3 deg."""
GOOD_POSE = f"{100 * REFINED_M:g} cm and {REFINED_DEG:g}°"


def is_good_pose(translation_m: ArrayLike, rotation_deg: ArrayLike) -> NDArray[np.bool_]:
    """(N,) whether refined poses are within both limits; a missing error is not."""
    near = np.asarray(translation_m, np.float64) <= REFINED_M
    return near & (np.asarray(rotation_deg, np.float64) <= REFINED_DEG)

"""What is kept of an image's depth, against a slow twin."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from airground.core.messages import GroundImage
from airground.core.se3 import SE3
from airground.ground_map.keyframe import JUMP, GroundKeyframe, usable_levels


def slowly(depth: NDArray, max_depth_m: float, step_m: np.float32) -> NDArray[np.uint16]:
    """Jumps marked on both sides, along rows and columns."""
    jump = np.zeros(depth.shape, bool)
    for axis in (0, 1):
        later, sooner = np.moveaxis(depth, axis, 0)[1:], np.moveaxis(depth, axis, 0)[:-1]
        found = np.abs(later - sooner) > JUMP * later
        marked = np.moveaxis(jump, axis, 0)
        marked[1:] |= found
        marked[:-1] |= found
    usable = ~jump & (depth > 0) & (depth <= max_depth_m)
    return np.rint(np.where(usable, depth, np.float32(0)) / step_m).astype(np.uint16)


@pytest.mark.kernel
@settings(deadline=None)  # the first example compiles
@given(st.integers(0, 2**32 - 1))
def test_depth_beside_jumps_and_too_far_is_left_out(seed: int) -> None:
    rng = np.random.default_rng(seed)
    depth = rng.uniform(1.0, 1.07, (12, 16)).astype(np.float32)
    depth[:, rng.integers(1, 16) :] *= rng.choice([1.0, 1.04, 2.0, 5.0])
    for nothing in (np.nan, 0.0, np.inf):
        depth[rng.random(depth.shape) < 0.03] = nothing
    step = np.float32(1e-4)
    with np.errstate(invalid="ignore"):
        expected = slowly(depth, 4.0, step)
    np.testing.assert_array_equal(usable_levels(depth, np.float32(4.0), step), expected)


def test_a_keyframe_gives_depth_back_within_half_a_step() -> None:
    depth = np.random.default_rng(0).uniform(2.0, 2.05, (12, 16)).astype(np.float32)
    image = GroundImage(7, np.full((12, 16, 3), 90, np.uint8), depth)
    keyframe = GroundKeyframe.pack(image, SE3.identity(), 4.0)
    assert np.abs(keyframe.depth() - depth).max() <= 0.51 * keyframe.step_m
    assert (np.abs(keyframe.colour().astype(int) - 90) <= 1).all()

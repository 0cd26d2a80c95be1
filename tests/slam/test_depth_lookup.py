"""Depth at corners: the middle of a steady neighbourhood, or none."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from airground.slam.depth_lookup import MAX_SPREAD, REACH_PX, STEPS, inverse_depths_at


def at(depth: np.ndarray, x: float, y: float, max_depth_m: float = 5.0) -> float:
    return float(inverse_depths_at(depth, np.array([[x, y]]), max_depth_m)[0])


def slowly(depth: NDArray, pixels: NDArray, max_depth_m: float) -> list[float]:
    """The same, a corner at a time."""
    height, width = depth.shape
    found = []
    for x_px, y_px in pixels:
        x = int(np.clip(np.rint(x_px), REACH_PX, width - 1 - REACH_PX))
        y = int(np.clip(np.rint(y_px), REACH_PX, height - 1 - REACH_PX))
        around = np.array([float(depth[y + dy, x + dx]) for dy in STEPS for dx in STEPS])
        middle = np.median(around)
        trusted = np.ptp(around) < MAX_SPREAD * middle and 0 < middle <= max_depth_m
        found.append(1.0 / middle if trusted else np.nan)
    return found


@pytest.mark.kernel
@settings(deadline=None)  # the first example compiles
@given(st.integers(0, 2**32 - 1), st.sampled_from([0.0, 0.001, 0.02]))
def test_every_corner_is_looked_up_as_one_would_by_hand(seed: int, holes: float) -> None:
    rng = np.random.default_rng(seed)
    depth = rng.uniform(2.0, 2.0 * (1 + 1.2 * MAX_SPREAD), (24, 30)).astype(np.float32)
    depth += rng.choice([0.0, 1.0]) * (np.arange(30) > rng.integers(30))
    kinds = [np.nan, np.inf, 0.0, -1.0]
    for hole in rng.choice(kinds, 2):
        depth[rng.random(depth.shape) < holes] = hole
    pixels = rng.uniform((-3, -3), (33, 27), (40, 2))
    with np.errstate(invalid="ignore"):
        expected = slowly(depth, pixels, 2.9)
    np.testing.assert_array_equal(inverse_depths_at(depth, pixels, 2.9), expected)


def test_a_slanted_surface_gives_its_depth_at_each_pixel() -> None:
    y, x = np.mgrid[:60, :80].astype(np.float32)
    depth = 2.0 + 0.004 * x + 0.002 * y
    rng = np.random.default_rng(0)
    pixels = rng.uniform((REACH_PX, REACH_PX), (79 - REACH_PX, 59 - REACH_PX), (50, 2))
    expected = 1.0 / (2.0 + 0.004 * np.rint(pixels[:, 0]) + 0.002 * np.rint(pixels[:, 1]))
    np.testing.assert_allclose(inverse_depths_at(depth, pixels, 5.0), expected, rtol=1e-6)


def test_neither_edges_nor_holes_nor_far_things_are_trusted() -> None:
    depth = np.full((60, 80), 2.0, np.float32)
    depth[:, 40:] = 2.0 * (1 + 1.5 * MAX_SPREAD)
    depth[30, 20] = np.nan
    depth[:, 60:] = 6.0
    assert at(depth, 10, 10) == 0.5
    for x, y in [(39, 10), (40, 10), (40 - REACH_PX, 10), (20, 30), (21, 31), (70, 10)]:
        assert np.isnan(at(depth, x, y)), (x, y)
    assert at(depth, 39 - REACH_PX, 10) == 0.5
    assert at(depth, 70, 10, max_depth_m=6.0) == pytest.approx(1 / 6)


def test_a_corner_at_the_border_takes_the_nearest_whole_neighbourhood() -> None:
    depth = np.full((60, 80), 2.0, np.float32)
    for x, y in [(0, 0), (79, 59), (-0.4, 59.4)]:
        assert at(depth, x, y) == 0.5
    assert inverse_depths_at(depth, np.empty((0, 2)), 5.0).shape == (0,)


@pytest.mark.parametrize("nothing", [0.0, np.nan, -1.0, np.inf])
def test_what_is_no_depth_gives_none(nothing: float) -> None:
    assert np.isnan(at(np.full((60, 80), nothing, np.float32), 10, 10))

"""Optical flow measures known slides, and says so where it cannot."""

from __future__ import annotations

import numpy as np
import pytest

from airground.slam.corners import detect_corners
from airground.slam.optical_flow import brightened, flow, flow_both_ways
from tests.slam.textures import slid, texture

IMAGE = texture()
CORNERS = detect_corners(IMAGE, np.empty((0, 2), np.float32), 150, 16)
INNER = CORNERS[((CORNERS > 40) & (CORNERS < (280, 200))).all(axis=1)]
WINDOW_PX = 17


@pytest.mark.parametrize("slide", [(3.25, -1.5), (-0.3, 0.7), (0.0, 0.0)])
def test_a_slide_is_measured_to_a_twentieth_of_a_pixel(slide: tuple[float, float]) -> None:
    found_px, found = flow(IMAGE, slid(IMAGE, *slide), INNER, INNER, WINDOW_PX, 1)
    assert found.mean() > 0.95
    off = np.linalg.norm(found_px[found] - INNER[found] - slide, axis=1)
    assert np.median(off) < 0.05


def test_a_far_slide_needs_a_start_or_levels() -> None:
    slide = np.array([21.0, 13.0])
    there = slid(IMAGE, *slide)

    def right(start: np.ndarray, levels: int) -> float:
        found_px, found = flow(IMAGE, there, INNER, start, WINDOW_PX, levels)
        off = np.linalg.norm(found_px - INNER - slide, axis=1)
        return float((found & (off < 0.3)).mean())

    assert right(INNER, 0) < 0.3
    assert right(INNER, 3) > 0.8
    assert right(INNER + (slide + 1.0).astype(np.float32), 0) > 0.95


@pytest.mark.parametrize("gain", [0.5, 0.8, 1.3])
def test_a_change_in_exposure_does_not_matter(gain: float) -> None:
    there = np.rint(gain * slid(IMAGE, 2.0, 1.0).astype(float)).clip(0, 255).astype(np.uint8)
    found_px, found = flow(IMAGE, there, INNER, INNER, WINDOW_PX, 1)
    assert found.mean() > 0.9
    assert np.median(np.linalg.norm(found_px[found] - INNER[found] - (2, 1), axis=1)) < 0.1


def test_what_left_the_image_or_looks_different_is_not_found() -> None:
    other = slid(IMAGE, 0.0, 0.0)
    other[:, 160:] = texture(seed=1)[:, 160:]
    _, found = flow(IMAGE, other, INNER, INNER, WINDOW_PX, 1)
    far = INNER[:, 0] > 160 + WINDOW_PX
    near = INNER[:, 0] < 160 - WINDOW_PX
    assert found[near].mean() > 0.95
    assert found[far].mean() < 0.5  # LK settles somewhere alike, now and then
    _, found = flow_both_ways(IMAGE, other, INNER, INNER, WINDOW_PX, 1, 0.7)
    assert found[near].mean() > 0.95
    assert found[far].mean() < 0.35

    _, found = flow(IMAGE, slid(IMAGE, -60.0, 0.0), INNER, INNER - (60, 0), WINDOW_PX, 0)
    assert not found[INNER[:, 0] < 60].any()


def test_a_dark_image_shows_nothing_and_no_corners_are_no_error() -> None:
    dark = np.full_like(IMAGE, 2)
    for a, b in [(IMAGE, dark), (dark, IMAGE)]:
        found_px, found = flow(a, b, INNER, INNER + 1, WINDOW_PX, 1)
        assert not found.any()
        np.testing.assert_array_equal(found_px, INNER + 1)
    nothing = np.empty((0, 2), np.float32)
    for follow in (
        flow(IMAGE, IMAGE, nothing, nothing, WINDOW_PX, 1),
        flow_both_ways(IMAGE, IMAGE, nothing, nothing, WINDOW_PX, 1, 0.5),
    ):
        assert (follow[0].shape, follow[1].shape) == ((0, 2), (0,))


def test_expectations_far_outside_are_simply_not_found() -> None:
    start = np.full_like(INNER, 1e9)
    start[::2] = -1e9
    assert not flow(IMAGE, IMAGE, INNER, start, WINDOW_PX, 1)[1].any()


def test_exposure_is_only_touched_where_it_differs() -> None:
    assert brightened(IMAGE, 1.01) is IMAGE
    half = (IMAGE // 2).astype(np.uint8)
    assert brightened(half, 2.0).mean() == pytest.approx(IMAGE.mean(), rel=0.01)

"""The book-keeping of followed corners: rows stay together, and nothing is counted twice."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from airground.slam.corners import detect_corners
from airground.slam.feature_tracker import FeatureTracker
from tests.slam.textures import slid, texture

IMAGE = texture()
NOTHING = np.empty((0, 2), np.float32)


def tracker_at(pixels: np.ndarray, ids: np.ndarray | None = None) -> FeatureTracker:
    tracker = FeatureTracker(17, 1)
    tracker.advance(IMAGE, tracker.pixels)
    tracker.add(np.arange(len(pixels)) if ids is None else ids, pixels)
    return tracker


def test_each_number_follows_its_own_corner() -> None:
    corners = detect_corners(IMAGE, NOTHING, 60, 25)
    ids = np.random.default_rng(0).permutation(60)[: len(corners)] + 100
    tracker = tracker_at(corners, ids)
    for step in (1, 2, 3):  # corners leave, one after the other
        tracker.advance(slid(IMAGE, -30.0 * step, 0.0), tracker.pixels - (30, 0))
    began = dict(zip(ids.tolist(), corners, strict=True))
    assert 20 < len(tracker.ids) < len(corners)
    assert len(tracker.ids) == len(tracker.pixels) == len(tracker.failures)
    expected = np.array([began[i] for i in tracker.ids.tolist()]) - (90, 0)
    assert np.abs(tracker.pixels - expected).max() < 1.0
    assert expected[:, 0].min() > 0


def test_only_failures_in_a_row_cost_a_corner_its_place() -> None:
    tracker = tracker_at(np.arange(8, dtype=np.float32).reshape(4, 2))
    judged = np.array([0, 1, 2])  # corner 3 is in no map yet, and not judged

    def judge(*fits: bool) -> None:
        rows = np.isin(judged, tracker.ids)
        tracker.judge(judged[rows], np.array(fits)[rows])

    judge(True, False, False)
    assert tracker.failures.tolist() == [0, 1, 1, 0]
    judge(True, True, False)
    assert tracker.ids.tolist() == [0, 1, 3]
    judge(True, False, True)
    assert tracker.ids.tolist() == [0, 1, 3]
    assert tracker.failures.tolist() == [0, 1, 0]


PIXELS = arrays(
    np.float32, st.tuples(st.integers(0, 40), st.just(2)), elements=st.floats(0, 200, width=32)
)


@settings(deadline=None, max_examples=50)
@given(pixels=PIXELS, seed=st.integers(0, 100), cell_px=st.sampled_from([7.0, 13.0, 50.0]))
def test_thinning_keeps_the_oldest_of_each_cell_and_is_done_at_once(
    pixels: np.ndarray, seed: int, cell_px: float
) -> None:
    ids = np.random.default_rng(seed).permutation(len(pixels))
    tracker = tracker_at(pixels, ids)
    tracker.thin(cell_px)
    oldest: dict[tuple[int, int], int] = {}
    for number, (x, y) in sorted(zip(ids.tolist(), pixels.tolist(), strict=True)):
        oldest.setdefault((int(x // cell_px), int(y // cell_px)), number)
    assert set(tracker.ids.tolist()) == set(oldest.values())
    for number, pixel in zip(tracker.ids, tracker.pixels, strict=True):
        np.testing.assert_array_equal(pixel, pixels[np.flatnonzero(ids == number)[0]])
    before = tracker.ids.copy()
    tracker.thin(cell_px)
    np.testing.assert_array_equal(tracker.ids, before)


def test_after_clearing_nothing_is_followed_and_nothing_breaks() -> None:
    tracker = tracker_at(np.full((3, 2), 100.0))
    tracker.clear()
    assert tracker.image is None
    tracker.advance(IMAGE, tracker.pixels)
    tracker.advance(IMAGE, tracker.pixels)
    tracker.judge(np.empty(0, np.int64), np.empty(0, bool))
    tracker.thin(13.0)
    assert len(tracker.ids) == len(tracker.pixels) == len(tracker.failures) == 0

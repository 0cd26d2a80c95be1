"""What an image shows that the last keyframe did not: parallax, not turning."""

from __future__ import annotations

import numpy as np
import pytest

from airground.core.se3 import SE3
from airground.slam.feature_tracker import FeatureTracker
from airground.slam.keyframe_choice import News, what_is_new
from airground.slam.rig_state import RigState
from airground.slam.sparse_map import Keyframe, SparseMap
from tests.slam.views import CAMERA, down_at, observe, seen_points

LAST = down_at([0.0, 0.0, 2.0])
COUNT, MAPPED = 40, 30


def news(here: SE3, kept: slice = slice(None)) -> News:
    points = seen_points(LAST, COUNT, (2.0, 2.0), np.random.default_rng(0))
    sparse_map, tracker = SparseMap(), FeatureTracker(17, 1)
    ids = sparse_map.new_points(np.zeros((COUNT, 2)), 0)
    sparse_map.place(ids[:MAPPED], points[:MAPPED])
    order = np.random.default_rng(1).permutation(COUNT)  # the tracker has its own order
    last = Keyframe(
        0,
        np.zeros((4, 4), np.uint8),
        RigState.at_origin(),
        ids[order],
        observe(LAST, points)[order],
        np.full(COUNT, np.nan),
    )
    tracker.add(ids[kept], observe(here, points)[kept])
    return what_is_new(sparse_map, last, tracker, LAST.rotation.T @ here.rotation, CAMERA)


@pytest.mark.parametrize("turn", [(0, 0, 0), (0.1, 0, 0), (0, -0.2, 0.0), (0.05, 0.1, 1.0)])
def test_turning_makes_no_parallax(turn: tuple[float, ...]) -> None:
    seen = news(down_at([0.0, 0.0, 2.0], turn))
    assert seen == News(1.0, 1.0, pytest.approx(0.0, abs=1e-3))


@pytest.mark.parametrize("turn", [(0, 0, 0), (0.05, 0.1, 1.0)])
def test_parallax_is_the_shift_by_distance(turn: tuple[float, ...]) -> None:
    # The turn is taken out; what is left is f b / z, all points being at 2 m from the keyframe.
    seen = news(SE3(down_at([0, 0, 0], turn).rotation, np.array([0.1, 0.0, 2.0])))
    assert seen.parallax_px == pytest.approx(CAMERA.fx * 0.1 / 2.0, rel=1e-3)


def test_shares_are_of_what_the_keyframe_saw() -> None:
    here = down_at([0.05, 0.0, 2.0])
    seen = news(here, slice(10, 35))
    assert (seen.share_left, seen.mapped_left) == (25 / COUNT, 20 / MAPPED)
    assert news(here, slice(0, 0)) == News(0.0, 0.0, 0.0)

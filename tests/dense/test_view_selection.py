"""Which frames make a depth map: distances, hovering, bounded memory."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from airground.config import ViewSelection as Parameters
from airground.core.se3 import SE3
from airground.dense.view_selection import PosedImage, ViewBuffer, ViewSet, view_spacing
from tests.dense.synthetic import DOWN

PARAMETERS = Parameters()
IMAGE = np.zeros((4, 4), np.uint8)


def frame(index: int, x: float, y: float = 0.0, z: float = 2.0) -> PosedImage:
    return PosedImage(index, IMAGE, SE3(DOWN, np.array([x, y, z])))


def test_every_frame_of_a_usual_flight_joins_where_16_may() -> None:
    views = ViewSet(frame(0, 0.0), Parameters(max_views=16))
    joined = [views.offer(frame(i, i * 0.5 / 30)) for i in range(1, 12)]
    assert joined == [True] * 7 + [False] * 4
    assert views.complete
    assert views.suffices()


def test_every_other_frame_of_a_usual_flight_joins() -> None:
    views = ViewSet(frame(20, 0.0), PARAMETERS)
    joined = [views.offer(frame(20 - i, -i * 0.5 / 30)) for i in range(1, 8)]
    assert joined == [False, True, False, True, False, True, False]
    joined = [views.offer(frame(20 + i, i * 0.5 / 30)) for i in range(1, 12)]
    assert joined == [False, True, False, True, False, True, False] + [False] * 4
    assert views.complete
    assert views.suffices()


def test_hovering_makes_no_views() -> None:
    rng = np.random.default_rng(0)
    reference = frame(0, 0.0)
    views, buffer = ViewSet(reference, PARAMETERS), ViewBuffer(PARAMETERS)
    for i in range(1, 500):
        still = frame(i, *rng.normal(0, 0.002, 2))
        buffer.push(still)
        assert not views.offer(still)
    assert not views.suffices()
    assert len(buffer.views) <= PARAMETERS.max_views


def test_rising_shows_no_depth() -> None:
    views = ViewSet(frame(0, 0, z=1.0), PARAMETERS)
    for i in range(1, 8):
        views.offer(frame(i, 0.0, z=1 + i * 0.016))
    assert not views.suffices()


@given(st.lists(st.tuples(*[st.floats(-0.3, 0.3)] * 3), max_size=120))
def test_buffer_is_bounded_near_and_spread(positions: list[tuple[float, float, float]]) -> None:
    buffer = ViewBuffer(PARAMETERS)
    for i, position in enumerate(positions):
        newest = frame(i, *position)
        buffer.push(newest)
        assert len(buffer.views) <= PARAMETERS.max_views
        assert all(v.distance(newest) <= PARAMETERS.depth_map_radius_m for v in buffer.views)
        for view in buffer.around(newest):
            assert view.distance(newest) >= view_spacing(PARAMETERS)


@given(st.lists(st.tuples(*[st.floats(-0.2, 0.2)] * 3), max_size=120))
def test_views_keep_their_distances(positions: list[tuple[float, float, float]]) -> None:
    reference = frame(0, 0.0, 0.0, 0.0)
    views = ViewSet(reference, PARAMETERS)
    members = [
        view for view in (frame(i + 1, *p) for i, p in enumerate(positions)) if views.offer(view)
    ]
    assert len(members) <= PARAMETERS.max_views
    for i, one in enumerate(members):
        assert one.distance(reference) <= PARAMETERS.depth_map_radius_m
        assert all(one.distance(two) >= view_spacing(PARAMETERS) for two in members[:i])

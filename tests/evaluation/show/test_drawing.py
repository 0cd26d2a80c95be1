"""Properties of drawing: rates, thinning, grids in metres, colours."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from airground.core.belief import CostMap, HeightMap
from airground.core.se3 import SE3
from airground.core.trajectory import Trajectory
from evaluation.show.rerun_view.images import SHADES, shade_index
from evaluation.show.rerun_view.localization import cut_out, on_costs, upright
from evaluation.show.rerun_view.robots import STEP_NS, GrowingPath
from evaluation.show.rerun_view.sensor_stream import Pace

FRAMES_NS = np.arange(90) * 33_333_333
corners = st.integers(-9, 9)
sides = st.integers(1, 12)


@pytest.mark.parametrize(("hz", "each"), [(30, 1), (10, 3), (5, 6), (1, 30)])
def test_a_pace_lets_every_nth_frame_through(hz: float, each: int) -> None:
    pace = Pace(hz)
    assert [pace.due(int(stamp)) for stamp in FRAMES_NS] == [i % each == 0 for i in range(90)]


@given(corners, corners, sides, sides, st.integers(0, 4), st.integers(0, 3))
def test_what_is_cut_out_stays_where_it_was(
    x: int, y: int, width: int, height: int, at_x: int, at_y: int
) -> None:
    heights = np.arange(20, dtype=np.float32).reshape(5, 4)
    made = HeightMap(heights, np.array([0.3, -0.7]), 10.0)
    cut = cut_out(made, made.origin + np.array([x, y]) / 10, (width, height))
    assert cut.heights.shape == (width, height)
    i, j = at_x - x, at_y - y
    if 0 <= i < width and 0 <= j < height:
        assert cut.heights[i, j] == heights[at_x, at_y]
        where = cut.origin + np.array([i, j]) / 10
        np.testing.assert_allclose(where, made.origin + np.array([at_x, at_y]) / 10)
    assert np.isfinite(cut.heights).sum() == np.isin(heights, cut.heights).sum()


@given(st.integers(0, 4), st.integers(0, 3))
def test_a_cell_is_drawn_in_the_middle_of_its_pixel(ix: int, iy: int) -> None:
    cells = np.zeros((5, 4), np.float32)
    cells[ix, iy] = 1
    made = CostMap(cells, np.array([2.0, -1.0]), 50.0, 0.0, "ncc")
    (pixel,) = on_costs((made.origin + np.array([ix, iy]) / 50)[None], made)
    row, column = np.argwhere(upright(cells) == 1)[0]
    np.testing.assert_allclose(pixel, (column + 0.5, row + 0.5), atol=1e-5)


@given(st.lists(st.floats(-10, 10), min_size=2, max_size=20))
def test_shades_rise_with_the_numbers_and_leave_one_for_holes(numbers: list[float]) -> None:
    values = np.sort(np.array(numbers))
    shades = shade_index(values, -3.0, 4.0).astype(int)
    assert (np.diff(shades) >= 0).all()
    assert shades.max() < SHADES
    assert shade_index(np.array([-3.0, 4.0, np.nan]), -3.0, 4.0).tolist() == [0, SHADES - 1, SHADES]


def test_a_corrected_path_moves_and_keeps_what_the_correction_leaves_out() -> None:
    path = GrowingPath()
    for i in range(4):
        path.add(i * STEP_NS, np.array([i, 0.0, 0.0]))
    path.add(3 * STEP_NS + 1, np.array([9.0, 9.0, 9.0]))  # too soon after the last one
    lifted = [SE3(np.eye(3), np.array([i, 0.0, 1.0])) for i in (1, 2)]
    path.follow(Trajectory.from_poses([STEP_NS, 2 * STEP_NS], lifted))
    (strip,) = path.drawn((0, 0, 0)).strips.as_arrow_array().to_pylist()  # type: ignore[union-attr]
    assert strip == [[0, 0, 0], [1, 0, 1], [2, 0, 1], [3, 0, 0]]

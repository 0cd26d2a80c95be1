"""Height maps: highest point, holes, lattice."""

import numpy as np
import pytest

from airground.core.height_map import lattice_index, make_height_map


def naive(points, cells_per_m):
    """{cell index: highest z} by one loop over the points."""
    cells = {}
    for x, y, z in points:
        if np.isfinite([x, y, z]).all():
            cell = (
                int(np.floor(np.float32(x * cells_per_m) + np.float32(0.5))),
                int(np.floor(np.float32(y * cells_per_m) + np.float32(0.5))),
            )
            cells[cell] = max(z, cells.get(cell, -np.inf))
    return cells


def random_points(rng, n=500):
    points = rng.uniform(-1, 1, (n, 3)).astype(np.float32)
    points[rng.random(n) < 0.1, rng.integers(3)] = np.nan
    return points


@pytest.mark.kernel
@pytest.mark.parametrize("cells_per_m", [10.0, 25.0])
def test_each_cell_holds_its_highest_point(cells_per_m):
    points = random_points(np.random.default_rng(1))
    height_map = make_height_map(points, cells_per_m, dilate_holes=False)
    expected = naive(points, np.float32(cells_per_m))
    assert height_map.filled_cells == len(expected)
    first = lattice_index(height_map)
    for cell, z in expected.items():
        assert height_map.heights[tuple(np.array(cell) - first)] == z


@pytest.mark.kernel
def test_dilation_fills_holes_by_the_highest_neighbour_and_changes_nothing_else():
    points = random_points(np.random.default_rng(2), 150)
    raw = make_height_map(points, 10.0, dilate_holes=False).heights
    filled = make_height_map(points, 10.0).heights
    padded = np.pad(raw, 1, constant_values=np.nan)
    for ix, iy in np.ndindex(raw.shape):
        if np.isfinite(raw[ix, iy]):
            assert filled[ix, iy] == raw[ix, iy]
            continue
        around = padded[ix : ix + 3, iy : iy + 3]
        around = around[np.isfinite(around)]
        expected = around.max() if len(around) else np.nan
        np.testing.assert_equal(filled[ix, iy], np.float32(expected))


@pytest.mark.kernel
def test_a_window_cuts_the_same_lattice():
    points = random_points(np.random.default_rng(3))
    whole = make_height_map(points, 20.0, dilate_holes=False)
    part = make_height_map(points, 20.0, False, ((-0.3, -0.2), (0.5, 0.4)))
    offset = lattice_index(part) - lattice_index(whole)
    nx, ny = part.heights.shape
    assert (nx, ny) == (17, 13)
    inside = whole.heights[offset[0] : offset[0] + nx, offset[1] : offset[1] + ny]
    np.testing.assert_array_equal(part.heights, inside)


@pytest.mark.parametrize("points", [np.zeros((0, 3)), np.full((4, 3), np.nan)])
def test_no_points_make_one_empty_cell(points):
    height_map = make_height_map(points, 25.0)
    assert height_map.heights.shape == (1, 1)
    assert height_map.filled_cells == 0

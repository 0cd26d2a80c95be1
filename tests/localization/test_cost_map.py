"""Costs of overlays: exact against naive loops, and the laws that they obey."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import fft

from airground.config import Localization
from airground.core.belief import HeightMap
from airground.core.height_map import lattice_index
from airground.localization.cost_map import (
    OffsetSearch,
    masked,
    overlay_at,
    overlay_turned,
    reach_of,
)
from airground.localization.hypotheses import search_positions
from airground.localization.turned_kernels import MARGIN, filled_cells, in_fours
from tests.localization import naive

CELLS_PER_M = 10.0


def random_map(rng, shape, first=(0, 0), holes=0.2, level=0.0):
    """Blocks of random heights with noise and holes."""
    coarse = rng.uniform(0, 1, (shape[0] // 4 + 1, shape[1] // 4 + 1))
    heights = np.kron(coarse, np.ones((4, 4)))[: shape[0], : shape[1]] + level
    heights += rng.normal(0, 0.01, shape)
    heights[rng.random(shape) < holes] = np.nan
    return HeightMap(heights.astype(np.float32), np.array(first) / CELLS_PER_M, CELLS_PER_M)


def config(cost, **changes):
    return Localization(cost=cost, search_radius_m=1.0, **changes)


def cost_map_of(aerial, ground, centre, heading, setting):
    return search_positions(aerial, ground, centre, heading, setting).cost_map(setting.cost)


@pytest.mark.parametrize("cost", ["zmssd", "ncc", "likelihood"])
@pytest.mark.parametrize("seed", range(3))
def test_all_offsets_equal_a_naive_double_loop(cost, seed):
    rng = np.random.default_rng(seed)
    aerial = random_map(rng, (14, 11), (-6, -4), level=2.0)
    ground = random_map(rng, (26, 30), (-12, -13))
    setting = config(cost)
    found = cost_map_of(aerial, ground, (0.6, -0.5), 0.3, setting)
    assert found.costs.shape == (21, 21)
    assert found.heading == 0.3
    first = np.rint(found.origin * CELLS_PER_M).astype(int)
    expected = np.full(found.costs.shape, np.nan)
    for ox, oy in np.ndindex(*expected.shape):
        start = np.array([-6, -4]) + first + (ox, oy) - (-12, -13)
        below = naive.piece(ground.heights, start, (14, 11))
        expected[ox, oy] = naive.cost(
            aerial.heights, below, setting, aerial.filled_cells, CELLS_PER_M
        )
    assert np.isnan(expected).any()
    assert np.isfinite(expected).any()
    np.testing.assert_allclose(found.costs, expected, rtol=1e-4, atol=2e-6)


@pytest.mark.kernel
@pytest.mark.parametrize("cost", ["zmssd", "ncc", "likelihood"])
def test_particles_equal_naive_interpolation(cost):
    rng = np.random.default_rng(5)
    aerial, ground = random_map(rng, (14, 11), (-6, -4)), random_map(rng, (26, 30), (-12, -13))
    setting = config(cost)
    positions = rng.uniform(-1.2, 1.2, (20, 2))
    found = overlay_at(aerial, ground, positions).costs(setting)
    turned = overlay_turned(aerial, ground, np.column_stack([positions, np.zeros(20)]))
    for p, u in enumerate(positions):
        below = np.empty((14, 11))
        for ix, iy in np.ndindex(14, 11):
            x, y = np.array([ix - 6, iy - 4]) + u * CELLS_PER_M - (-12, -13)
            below[ix, iy] = naive.bilinear(ground.heights, x, y)
        expected = naive.cost(aerial.heights, below, setting, aerial.filled_cells, CELLS_PER_M)
        np.testing.assert_allclose(found[p], expected, rtol=1e-3, atol=1e-5)
    np.testing.assert_allclose(turned.costs(setting), found, rtol=2e-3, atol=1e-4)


@pytest.mark.parametrize("turned", [False, True])
def test_a_particle_alone_costs_what_it_costs_among_others(turned):
    """Alone, only the ground within its reach is looked at."""
    rng = np.random.default_rng(15)
    aerial, ground = random_map(rng, (14, 11), (-9, -4)), random_map(rng, (46, 50), (-22, -23))
    poses = rng.uniform(-3.5, 3.5, (60, 3))  # some on the edge, some beyond it
    if turned:
        overlay = lambda poses: overlay_turned(aerial, ground, poses)  # noqa: E731
    else:
        overlay = lambda poses: overlay_at(aerial, ground, poses[:, :2])  # noqa: E731
    together = overlay(poses)
    alone = [overlay(pose[None]) for pose in poses]
    np.testing.assert_array_equal(together.sums[:, 0], [one.sums[0, 0] for one in alone])
    assert (together.sums[:, 0] > 100).any()
    assert (together.sums[:, 0] == 0).any()
    offsets = [one.height_offsets()[0] for one in alone]
    np.testing.assert_allclose(together.height_offsets(), offsets, atol=1e-5)
    costs = [one.costs(config("ncc"))[0] for one in alone]
    np.testing.assert_allclose(together.costs(config("ncc")), costs, atol=1e-4)


@pytest.mark.parametrize("width", [16, 32, 33, 70])  # rows are summed by 32 cells
@pytest.mark.parametrize("cost", ["zmssd", "ncc", "likelihood"])
def test_a_particle_on_the_lattice_costs_what_the_map_says(cost, width):
    rng = np.random.default_rng(6)
    aerial = random_map(rng, (20, width), (-9, -width // 2 + 1))
    ground = random_map(rng, (40, width + 24), (-20, -width // 2 - 12))
    setting = config(cost)
    whole = cost_map_of(aerial, ground, (0.0, 0.0), 0.0, setting)
    cells = np.array(list(np.ndindex(*whole.costs.shape)))
    single = overlay_at(aerial, ground, whole.origin + cells / CELLS_PER_M).costs(setting)
    np.testing.assert_allclose(single, whole.costs.ravel(), rtol=1e-3, atol=1e-5)


@pytest.mark.parametrize("cost", ["zmssd", "ncc", "likelihood"])
@settings(max_examples=15, deadline=None)
@given(st.integers(-5, 5), st.integers(-5, 5), st.floats(-5, 5))
def test_a_known_shift_and_height_are_recovered(cost, dx, dy, lift):
    ground = random_map(np.random.default_rng(7), (60, 60), (-30, -30), holes=0.1)
    piece = ground.heights[15:45, 15:45] + np.float32(lift)
    aerial = HeightMap(piece, np.array([-15 - dx, -15 - dy]) / CELLS_PER_M, CELLS_PER_M)
    best = cost_map_of(aerial, ground, (0.0, 0.0), 0.0, config(cost)).best()
    np.testing.assert_allclose(best, np.array([dx, dy]) / CELLS_PER_M, atol=1e-9)
    offset = overlay_at(aerial, ground, best[None]).height_offsets()[0]
    assert offset == pytest.approx(-lift, abs=1e-4)


def test_twice_the_overlap_is_twice_the_evidence():
    """The same heights twice side by side: cells double, and the correlation stays."""
    rng = np.random.default_rng(13)
    aerial, ground = random_map(rng, (20, 16), (0, 0)), random_map(rng, (20, 16), (0, 0))
    ground.heights.flags.writeable = True
    ground.heights[:] = aerial.heights + rng.normal(0, 0.1, (20, 16))
    setting = config("likelihood", min_overlap=0.0)

    def evidence(times):
        maps = [
            HeightMap(np.tile(one.heights, (times, 1)), one.origin, CELLS_PER_M)
            for one in (aerial, ground)
        ]
        return overlay_at(*maps, np.zeros((1, 2))).costs(setting)[0]

    assert evidence(1) < -1
    assert evidence(2) == pytest.approx(2 * evidence(1), rel=1e-3)


def test_heights_that_disagree_are_no_evidence():
    rng = np.random.default_rng(14)
    aerial = random_map(rng, (20, 16), (0, 0), holes=0.0)
    upside_down = HeightMap(-aerial.heights, aerial.origin, CELLS_PER_M)
    found = overlay_at(aerial, upside_down, np.zeros((1, 2)))
    assert found.costs(config("likelihood")) == 0.0


@settings(max_examples=15, deadline=None)
@given(st.floats(-20, 20))
def test_a_vertical_offset_leaves_eq_2_unchanged(lift):
    rng = np.random.default_rng(8)
    aerial, ground = random_map(rng, (20, 16), (-9, -7)), random_map(rng, (40, 40), (-20, -20))
    lifted = HeightMap(aerial.heights + np.float32(lift), aerial.origin, CELLS_PER_M)
    low, high = (
        cost_map_of(m, ground, (0, 0), 0.0, config("zmssd")).costs for m in (aerial, lifted)
    )
    np.testing.assert_allclose(low, high, rtol=1e-3, atol=1e-5)


@settings(max_examples=10, deadline=None)
@given(st.integers(-40, 40), st.integers(-40, 40))
def test_moving_ground_and_search_moves_the_costs(dx, dy):
    rng = np.random.default_rng(9)
    aerial, ground = random_map(rng, (20, 16), (-9, -7)), random_map(rng, (40, 40), (-20, -20))
    shift = np.array([dx, dy]) / CELLS_PER_M
    moved = HeightMap(ground.heights, ground.origin + shift, CELLS_PER_M)
    here = cost_map_of(aerial, ground, (0, 0), 0.0, config("ncc"))
    there = cost_map_of(aerial, moved, shift, 0.0, config("ncc"))
    np.testing.assert_allclose(there.origin, here.origin + shift, atol=1e-9)
    np.testing.assert_array_equal(here.costs, there.costs)


def test_swapping_the_maps_mirrors_eq_2():
    rng = np.random.default_rng(10)
    a, g = random_map(rng, (20, 20), (-10, -10)), random_map(rng, (20, 20), (-10, -10))
    setting = config("zmssd", min_overlap=0.0)
    one = cost_map_of(a, g, (0, 0), 0.0, setting).costs
    other = cost_map_of(g, a, (0, 0), 0.0, setting).costs
    np.testing.assert_allclose(one, other[::-1, ::-1], rtol=1e-3, atol=1e-5)


def test_turning_the_aerial_map_back_finds_it():
    """A quarter turn is exact on the lattice."""
    ground = random_map(np.random.default_rng(11), (41, 41), (-20, -20), holes=0.1)
    turned = HeightMap(np.rot90(ground.heights, -1).copy(), ground.origin, CELLS_PER_M)
    poses = np.array([[0.0, 0.0, np.pi / 2], [0.0, 0.0, 0.0]])
    right, wrong = overlay_turned(turned, ground, poses).costs(config("ncc"))
    assert right == pytest.approx(0.0, abs=1e-3)
    assert wrong > 0.3


def test_flat_ground_correlates_with_nothing():
    rng = np.random.default_rng(12)
    noise = rng.normal(0, 0.004, (40, 40)).astype(np.float32)
    ground = HeightMap(noise, np.array([-2.0, -2.0]), CELLS_PER_M)
    aerial = HeightMap(noise[10:30, 10:30], np.array([-1.0, -1.0]), CELLS_PER_M)
    costs = cost_map_of(aerial, ground, (0, 0), 0.0, config("ncc")).costs
    assert np.nanmin(costs) > 0.95


@pytest.mark.kernel
def test_heights_about_their_mean_are_those_of_arrays() -> None:
    heights = np.random.default_rng(0).normal(3, 1, (7, 5)).astype(np.float32)
    heights[1, 2:] = np.nan
    filled = np.isfinite(heights)
    split = masked(heights, margin=2)
    assert split.mean == pytest.approx(np.nanmean(heights, dtype=np.float64), abs=1e-12)
    centred = np.where(filled, heights - np.float32(split.mean), 0)
    assert np.array_equal(split.heights, np.pad(centred, 2))
    assert np.array_equal(split.mask, np.pad(filled, 2))
    assert split.heights.dtype == split.mask.dtype == np.float32
    longer = masked(heights, margin=2, after=3)
    assert np.array_equal(longer.heights, np.pad(split.heights, ((0, 0), (0, 3))))
    assert np.array_equal(longer.mask, np.pad(split.mask, ((0, 0), (0, 3))))
    empty = masked(np.full((3, 4), np.nan, np.float32))
    assert empty.mean == 0
    assert not empty.heights.any()
    assert not empty.mask.any()


@pytest.mark.kernel
def test_filled_cells_are_those_of_arrays() -> None:
    heights = random_map(np.random.default_rng(1), (7, 5), (0, 0)).heights
    cells, mean = filled_cells(heights, -3, 4)
    filled = np.isfinite(heights)
    assert 0 < filled.sum() < filled.size
    assert mean == pytest.approx(np.nanmean(heights, dtype=np.float64), abs=1e-12)
    assert np.array_equal(cells[:2].T, np.argwhere(filled) + np.array([-3, 4]))
    assert np.array_equal(cells[2], heights[filled] - np.float32(mean))
    assert filled_cells(np.full((2, 3), np.nan, np.float32), 0, 0)[0].shape == (3, 0)


@pytest.mark.kernel
def test_fours_hold_each_height_with_those_beside_and_behind() -> None:
    heights = random_map(np.random.default_rng(2), (6, 9), (0, 0)).heights
    fours, mean = in_fours(heights)
    centred = np.pad(heights - np.float32(mean), MARGIN, constant_values=np.nan)
    wider = np.pad(centred, (0, 1), constant_values=np.nan)
    assert np.isnan(heights).any()
    around = [centred, wider[:-1, 1:], wider[1:, :-1], wider[1:, 1:]]
    np.testing.assert_array_equal(fours, np.stack(around, axis=2))


def test_transforms_of_filled_rows_alone_are_the_whole_ones() -> None:
    """What is not computed is zero before, or no offset after: the same bits otherwise."""
    rng = np.random.default_rng(3)
    aerial, ground = random_map(rng, (14, 11), (-6, -4)), random_map(rng, (26, 30), (-12, -13))
    search = OffsetSearch(ground, (0.1, -0.2), 1.0, reach_of(aerial))
    size = search._fft_shape
    a, g = masked(aerial.heights), masked(under_offsets(ground, search, aerial))
    pairs = [
        (a.mask, g.mask),
        (a.heights, g.mask),
        (a.mask, g.heights),
        (a.heights**2, g.mask),
        (a.mask, g.heights**2),
        (a.heights, g.heights),
    ]
    nx, ny = search.shape
    found = search.sums(aerial)
    for index, (over, under) in enumerate(pairs):
        product = fft.rfft2(over, size).conj() * fft.rfft2(under, size)
        expected = fft.irfft2(product, size)[:nx, :ny]
        if index == 0:
            expected = np.rint(expected)
        np.testing.assert_array_equal(found[..., index], expected)


@pytest.mark.kernel
def test_sums_of_differences_are_the_six_sums_combined() -> None:
    rng = np.random.default_rng(4)
    aerial, ground = random_map(rng, (14, 11), (-6, -4)), random_map(rng, (26, 30), (-12, -13))
    search = OffsetSearch(ground, (0.1, -0.2), 1.0, reach_of(aerial))
    count, sum_a, sum_g, sum_aa, sum_gg, sum_ag = np.moveaxis(search.sums(aerial), -1, 0)
    found = search.difference_sums(aerial)
    assert count.max() > 100
    np.testing.assert_array_equal(found[..., 0], count)
    np.testing.assert_allclose(found[..., 1], sum_a - sum_g, atol=1e-4)
    np.testing.assert_allclose(found[..., 2], sum_aa + sum_gg - 2 * sum_ag, atol=1e-4)


def under_offsets(ground: HeightMap, search: OffsetSearch, aerial: HeightMap) -> np.ndarray:
    """The ground heights that some offset lays the aerial map over, NaN outside the map."""
    padded = np.pad(ground.heights, 40, constant_values=np.nan)
    low = search.first + reach_of(aerial)[0] - lattice_index(ground) + 40
    high = low + search.shape + aerial.heights.shape - np.array(1)
    return padded[low[0] : high[0], low[1] : high[1]]

"""Agreement of heights in channels: exact against naive loops, and what it leaves out."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from airground.config import Localization
from airground.core.belief import HeightMap
from airground.core.height_map import lattice_index
from airground.localization.channel_kernels import (
    AERIAL,
    CHANNEL_M,
    CHANNELS,
    GROUND,
    SHIFTS,
    SUMS,
    in_channels,
    levels_above,
    log_agreement_ratio,
)
from airground.localization.channels import (
    ChannelOverlay,
    ChannelSearch,
    every,
    floor_of,
    stride_of,
)
from airground.localization.cost_map import reach_of
from tests.localization.test_cost_map import random_map

CELLS_PER_M = 25.0
CONFIG = Localization(search_radius_m=0.6)


def finer_map(rng, shape, first, holes=0.2, level=0.0):
    """Blocks on a floor at the resolution of `best`: every second cell is looked at."""
    heights = random_map(rng, shape, first, holes).heights
    on_floor = heights < 0.4
    heights = heights + np.float32(level)
    heights[on_floor] = level + rng.normal(0, 0.005, int(on_floor.sum()))
    return HeightMap(heights, np.array(first) / CELLS_PER_M, CELLS_PER_M)


def naive_weights(level):
    """The weights of one height, by the distance of each channel."""
    return np.clip(1 - np.abs(level - np.arange(CHANNELS)), 0, 1)


def naive_floor(heights):
    """Middle of the fullest bin of 2 cm; of equally full ones the lowest."""
    bins = np.floor(heights[np.isfinite(heights)] / np.float32(0.02))
    fullest = max(sorted(set(bins.tolist())), key=bins.tolist().count)
    return (fullest + 0.5) * 0.02


def naive_cost(aerial, ground, pose, config):
    """The cost of one pose: each second aerial cell, and the ground cell below it."""
    first_a, first_g = lattice_index(aerial), lattice_index(ground)
    few_a = [c for c in np.ndindex(*aerial.heights.shape) if not ((first_a + c) % 2).any()]
    few_g = [c for c in np.ndindex(*ground.heights.shape) if not ((first_g + c) % 2).any()]
    few_a = [c for c in few_a if np.isfinite(aerial.heights[c])]
    floor_a = naive_floor(np.array([aerial.heights[c] for c in few_a]))
    floor_g = naive_floor(np.array([ground.heights[c] for c in few_g]))

    def level(height, floor):
        return np.clip((height - floor) / CHANNEL_M, 0, CHANNELS - 1)

    best, count = 0.0, 0
    for shift in SHIFTS:
        over, under = [], []
        for cell in few_a:
            x, y = (first_a + cell) @ np.array(
                [[np.cos(pose[2]), np.sin(pose[2])], [-np.sin(pose[2]), np.cos(pose[2])]]
            )
            at = np.floor(np.array([x, y]) + pose[:2] * CELLS_PER_M + 0.5).astype(int) - first_g
            inside = (at >= 0).all() and (at < ground.heights.shape).all()
            if inside and np.isfinite(ground.heights[tuple(at)]):
                lifted = level(aerial.heights[cell], floor_a) + shift
                over.append(naive_weights(np.clip(lifted, 0, CHANNELS - 1)))
                under.append(naive_weights(level(ground.heights[tuple(at)], floor_g)))
        count = len(over)
        if count <= config.min_overlap * len(few_a):
            return np.nan
        # Chance: any aerial cell of the overlap over any ground cell of it.
        agreed = np.mean([a @ g for a, g in zip(over, under, strict=True)])
        chance = np.mean([a @ g for a in over for g in under])
        agreed, chance = np.clip([agreed, chance], 1e-3, 1 - 1e-3)
        if agreed > chance:
            other = (1 - agreed) * np.log((1 - agreed) / (1 - chance))
            best = max(best, agreed * np.log(agreed / chance) + other)
    return -count * best / (config.patch_m * CELLS_PER_M / 2) ** 2


@pytest.mark.kernel
@pytest.mark.parametrize("seed", range(3))
def test_all_offsets_equal_naive_loops(seed):
    rng = np.random.default_rng(seed)
    aerial = finer_map(rng, (13, 10), (-6, -3), level=2.0)
    ground = finer_map(rng, (30, 26), (-13, -12))
    search = ChannelSearch(ground, floor_of(every(aerial, 2)), (0.1, 0), 0.8, reach_of(aerial))
    found = search.costs(aerial, CONFIG)
    want = np.empty(found.shape)
    for offset in np.ndindex(*found.shape):
        pose = np.array([*(search.first + offset) / search.cells_per_m, 0.0])
        want[offset] = naive_cost(aerial, ground, pose, CONFIG)
    assert np.isnan(want).any()
    assert (want < 0).sum() > 10
    np.testing.assert_allclose(found, want, rtol=2e-3, atol=1e-4)


@pytest.mark.kernel
def test_particles_equal_naive_loops():
    rng = np.random.default_rng(5)
    aerial, ground = finer_map(rng, (13, 10), (-6, -3)), finer_map(rng, (30, 26), (-13, -12))
    poses = rng.uniform((-0.8, -0.8, -3), (0.8, 0.8, 3), (30, 3))
    found = ChannelOverlay.of(aerial, ground).costs(poses, CONFIG)
    want = [naive_cost(aerial, ground, pose, CONFIG) for pose in poses]
    np.testing.assert_allclose(found, want, rtol=1e-4, atol=1e-5)
    assert np.nanmin(found) < -0.1
    assert np.isnan(found).any()


def test_floor_over_floor_is_no_evidence():
    """Boxes beside the overlap do not make the floor in it rare."""
    rng = np.random.default_rng(9)
    ground = np.zeros((120, 120), np.float32)
    ground[:40] = np.where(random_map(rng, (40, 120), holes=0.0).heights > 0.5, 0.5, 0.0)
    aerial = np.zeros((60, 60), np.float32)
    aerial[40:] = 0.4
    maps = [
        HeightMap(
            heights + rng.normal(0, 0.01, heights.shape).astype(np.float32), origin, CELLS_PER_M
        )
        for heights, origin in ((aerial, np.zeros(2)), (ground, np.array([-2.4, -2.4])))
    ]
    overlay, beside = ChannelOverlay.of(*maps), np.array([0.8, 0.4, 0.0])
    assert overlay.costs(beside[None], CONFIG)[0] > -0.1


@pytest.mark.kernel
def test_levels_and_weights_equal_naive_ones():
    heights = np.array([[-5.0, 0.0, 0.04], [0.25, 7.0, np.nan]], np.float32)
    levels = levels_above(heights, 0.0)
    np.testing.assert_allclose(levels, [[0, 0, 0.4], [2.5, 9, np.nan]], rtol=1e-6)
    weights = in_channels(levels)
    for cell in np.ndindex(*heights.shape):
        want = naive_weights(levels[cell]) if np.isfinite(heights[cell]) else np.zeros(CHANNELS)
        np.testing.assert_allclose(weights[(slice(None), *cell)], want, atol=1e-6)


def test_a_cost_is_what_the_area_that_agrees_says():
    """Of 100 cells 80 agree, where half would by chance: 80 ln 1.6 + 20 ln 0.4, in patches of 4."""
    sums = np.zeros((3, SUMS))
    for channel in (0, 9):
        sums[:, AERIAL + channel] = sums[:, GROUND + channel] = 50
    sums[:, 0] = 80, 50, 9
    sums[2, AERIAL:] = 0
    sums[2, [AERIAL, GROUND]] = 9
    found = log_agreement_ratio(sums, min_count=10, cells_of_patch=4)
    assert found[0] == pytest.approx(-(80 * np.log(1.6) + 20 * np.log(0.4)) / 4)
    assert found[1] == 0
    assert np.isnan(found[2])


@settings(max_examples=20, deadline=None)
@given(st.integers(-4, 4), st.integers(-4, 4), st.floats(-5, 5))
def test_a_known_shift_is_recovered_whatever_the_height(dx, dy, lift):
    ground = finer_map(np.random.default_rng(7), (80, 80), (-40, -40), holes=0.1)
    heights = ground.heights[20:60, 20:60] + np.float32(lift)
    shift = 2 * np.array([dx, dy])
    aerial = HeightMap(heights, (np.array([-20, -20]) - shift) / CELLS_PER_M, CELLS_PER_M)
    search = ChannelSearch(ground, floor_of(every(aerial, 2)), (0, 0), 0.6, reach_of(aerial))
    costs = search.costs(aerial, CONFIG)
    best = np.unravel_index(np.nanargmin(costs), costs.shape) + search.first
    np.testing.assert_array_equal(best * 2, shift)


def test_boxes_that_were_moved_do_not_outweigh_those_that_stayed():
    """A tall one in place of floor makes the right place the worse one by correlation alone."""
    rng = np.random.default_rng(3)
    ground = finer_map(rng, (80, 80), (-40, -40), holes=0.0)
    heights = ground.heights[20:60, 20:60].copy()
    aerial = HeightMap(heights, np.array([-20, -20]) / CELLS_PER_M, CELLS_PER_M)
    moved = heights.copy()
    moved[:13, :13] += 3.0
    changed = HeightMap(moved, aerial.origin, CELLS_PER_M)
    there, away = np.zeros((1, 3)), np.array([[0.24, 0.16, 0.0]])
    for one in (aerial, changed):
        overlay = ChannelOverlay.of(one, ground)
        right, wrong = overlay.costs(there, CONFIG), overlay.costs(away, CONFIG)
        assert right < 2 * wrong - 10


@pytest.mark.parametrize("slope", [0.15, -0.18])
def test_floors_that_are_not_at_one_height_are_tried_against_each_other(slope):
    """Half of the ground lies higher than the rest, and most of the aerial map over that half."""
    rng = np.random.default_rng(4)
    flat = random_map(rng, (80, 80), (-40, -40), holes=0.0).heights
    floor = flat < 0.5
    heights = np.where(floor, 0.0, flat).astype(np.float32)
    heights[50:] += np.float32(slope)
    ground = HeightMap(heights, np.array([-40, -40]) / CELLS_PER_M, CELLS_PER_M)
    piece = HeightMap(heights[44:74, 20:60], np.array([4, -20]) / CELLS_PER_M, CELLS_PER_M)
    assert abs(floor_of(piece) - floor_of(ground)) > 0.1
    costs = ChannelOverlay.of(piece, ground).costs(
        np.array([[0.0, 0, 0], [-0.32, 0, 0], [0.16, 0.16, 0]]), CONFIG
    )
    assert costs[0] < 2 * costs[1:].min() - 10


def test_every_second_cell_is_the_same_cell_in_every_map():
    heights = np.arange(30, dtype=np.float32).reshape(5, 6)
    for first in ((0, 0), (-3, 1), (2, -5)):
        few = every(HeightMap(heights, np.array(first) / CELLS_PER_M, CELLS_PER_M), 2)
        assert few.cells_per_m == CELLS_PER_M / 2
        at = 2 * lattice_index(few) - first
        np.testing.assert_array_equal(few.heights, heights[at[0] :: 2, at[1] :: 2])
    lone = HeightMap(np.ones((1, 1), np.float32), np.array([1, 1]) / CELLS_PER_M, CELLS_PER_M)
    assert every(lone, 2).filled_cells == 0
    empty = HeightMap(np.full((2, 2), np.nan, np.float32), np.zeros(2), CELLS_PER_M)
    assert floor_of(empty) == 0
    assert [stride_of(cells) for cells in (5.0, 12.5, 25.0, 50.0)] == [1, 1, 2, 4]
